//! A run from one step to the next: rows, snapshots, checkpoints, and how it ends.

use super::super::{
    common::{size, warn},
    progress::Progress,
};
use super::{frames::Frames, interrupt::interrupted};
use packstone::{
    Error,
    io::{
        Results,
        schedule::{Amount, Forecast, Schedule, step_at},
        summary::{Deepest, Ending, State, Summary},
    },
    measure::{CellSample, Packing, Sample, micromechanics::packing::LoadOnWall},
    protocol::jamming::{Jamming, Look},
    scene::{Assembly, Scene, grain_file::Moment},
    simulation::Simulation,
};
use serde::{Deserialize, Serialize};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// What a checkpoint has of the run.
#[derive(Serialize, Deserialize)]
pub struct SoFar {
    pub schedule: Schedule,
    pub wall_seconds: f64,
    pub deepest: Option<Deepest>,
    #[serde(default)]
    pub inherited: f64,
    #[serde(default)]
    pub jamming: Jamming,
    /// What it has come to, if nothing but its results is left to be written.
    #[serde(default)]
    pub reached: Option<Goal>,
}

/// More snapshots than that are announced, files and bytes.
const MANY: Amount = Amount { files: 1000, bytes: 1_000_000_000 };

/// A chunk of steps should take no longer, so that Ctrl-C is noticed and checkpoints come in time.
const CHUNK: Duration = Duration::from_millis(250);

/// What is said of many snapshots before they are written.
pub fn flood(assembly: &Assembly, schedule: &Schedule) -> Option<String> {
    let Amount { files, bytes } = Forecast::new(&assembly.whole(), schedule, schedule.end?).of_snapshots;
    (files > MANY.files || bytes > MANY.bytes).then(|| {
        format!(
            "snapshots will be {files} files, {}; longer output.snapshots or fewer output.formats make them less",
            size(bytes)
        )
    })
}

/// What a run is to come to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Goal {
    LastStep,
    /// A strain, a fraction or a pressure of the cell.
    TargetMet,
    /// Equilibrium.
    AtRest,
    /// Nothing is left to move or to carry grains.
    Unjammed,
    /// The jamming fraction is known.
    Jammed,
    /// No grain is left, and none will come.
    Empty,
}

/// Why a run is over.
pub enum End {
    Reached(Goal),
    Interrupted,
    /// By an error.
    Stopped(Error),
}

impl Goal {
    pub fn label(self) -> &'static str {
        match self {
            Goal::LastStep => "last step",
            Goal::TargetMet => "target met",
            Goal::AtRest => "at rest",
            Goal::Unjammed => "at rest, unjammed",
            Goal::Jammed => "jamming fraction found",
            Goal::Empty => "no grain left",
        }
    }
}

impl End {
    fn label(&self) -> &'static str {
        match self {
            End::Reached(goal) => goal.label(),
            End::Interrupted => "interrupted",
            End::Stopped(_) => "error",
        }
    }
}

/// What there is of a run in the end.
pub struct Written {
    pub summary: Summary,
    pub end: End,
    /// Where.
    pub place: PathBuf,
    /// Why the results are not where they should be.
    pub spoilt: Option<Error>,
}

pub struct Run {
    pub simulation: Simulation,
    pub results: Results,
    pub schedule: Schedule,
    /// Pictures in the course of time, if they are asked for.
    frames: Option<Frames>,
    /// The step that it began with, and when.
    first: u64,
    start: Instant,
    /// Wall time before that, of a run that goes on, s.
    pub earlier: f64,
    /// When the last checkpoint was written, or none was yet, and its step.
    checkpointed: Instant,
    pub saved: Option<u64>,
    /// The deepest overlap so far.
    pub deepest: Option<Deepest>,
    /// The deepest overlap of the state of another run that it began with, over the radius: not its own.
    pub inherited: f64,
    /// What it knows of the jamming fraction, if it looks for it.
    pub jamming: Jamming,
    /// What it has come to; None as long as it has steps to do.
    pub reached: Option<Goal>,
    /// Steps of a chunk that take about as long as [`CHUNK`].
    most_steps: u64,
    /// When the last row was written, and what it says.
    row: (Instant, Option<Sample>),
    /// Over the radius: with a larger overlap the time step is above its bound.
    stable_overlap: f64,
}

impl Run {
    pub fn new(simulation: Simulation, results: Results, schedule: Schedule, frames: Option<Frames>) -> Run {
        let assembly = simulation.assembly();
        let start = Instant::now();
        Run {
            results,
            schedule,
            frames,
            first: simulation.step(),
            start,
            earlier: 0.0,
            checkpointed: start,
            saved: None,
            deepest: None,
            inherited: 0.0,
            jamming: Jamming::default(),
            reached: None,
            most_steps: 1,
            row: (start, None),
            stable_overlap: if assembly.solver.allow_unstable { f64::INFINITY } else { simulation.stable_overlap() },
            simulation,
        }
    }

    pub fn drive(&mut self) -> packstone::Result<End> {
        if let Some(goal) = self.reached {
            // Its results were not all written.
            return Ok(End::Reached(goal));
        }
        let mut progress = Progress::start(&self.simulation, self.schedule.end);
        let end = loop {
            match self
                .pause()
                .and_then(|end| if end.is_none() { self.advance(&mut progress) } else { Ok(()) }.map(|()| end))
            {
                Ok(Some(end)) => break end,
                Ok(None) => {}
                // What the simulation still holds is the last good state, also where the device gave up or the disk is full.
                Err(error @ (Error::Run { .. } | Error::Lacking(_) | Error::Device(_) | Error::Io { .. })) => {
                    break End::Stopped(error);
                }
                Err(error) => return Err(error),
            }
        };
        progress.finish(&self.simulation);
        if let End::Reached(goal) = end {
            self.reached = Some(goal);
        }
        Ok(end)
    }

    /// Whatever is due at this step, and whether it is the last one.
    fn pause(&mut self) -> packstone::Result<Option<End>> {
        let step = self.simulation.step();
        let last = Some(step) == self.schedule.end;
        // Clocks tick only when what is due is written.
        if self.schedule.snapshots.is_some_and(|clock| clock.next() <= step) {
            self.snapshot()?;
            self.schedule.snapshots.as_mut().map(|clock| clock.strikes(step));
        }
        if self.frames.as_ref().is_some_and(|frames| frames.next() <= step) {
            self.frame(Frames::add)?;
        }
        let (mut rest, mut met, mut fault) = (None, false, None);
        if self.schedule.history.next() <= step {
            let (sample, loads) = self.record()?;
            self.schedule.history.strikes(step);
            rest = self.rest(&sample, &loads)?;
            met = self.has_met_target(&sample);
            fault = self.fault(&sample);
        }
        Ok(match () {
            () if fault.is_some() => fault.map(End::Stopped),
            () if met || last && self.ends_at_target() => Some(End::Reached(Goal::TargetMet)),
            () if rest.is_some() => rest.map(End::Reached),
            () if last => Some(End::Reached(Goal::LastStep)),
            () if self.simulation.particles() == 0 && !self.simulation.expects_grains() => {
                Some(End::Reached(Goal::Empty))
            }
            () if interrupted() => Some(End::Interrupted),
            () => None,
        })
    }

    /// Up to the next step at which something is due, or until Ctrl-C.
    fn advance(&mut self, progress: &mut Progress) -> packstone::Result<()> {
        let next = self.schedule.next().min(self.frames.as_ref().map_or(u64::MAX, Frames::next));
        while self.simulation.step() < next {
            let every = self.simulation.assembly().output.checkpoint;
            if every > 0.0 && self.checkpointed.elapsed().as_secs_f64() >= every {
                self.checkpoint()?;
            }
            let begin = Instant::now();
            let steps = self.simulation.advance_chunk(self.most_steps.min(next - self.simulation.step()))?;
            self.most_steps = ((steps as f64 * CHUNK.as_secs_f64() / begin.elapsed().as_secs_f64()) as u64).max(1);
            Deepest::update_from_steps(&mut self.deepest, &self.simulation);
            progress.update(&self.simulation);
            if interrupted() {
                break;
            }
        }
        Ok(())
    }

    /// Write one. What is due at this step has been done.
    pub fn checkpoint(&mut self) -> packstone::Result<()> {
        let Run { simulation, results, schedule, inherited, jamming, reached, .. } = self;
        let wall_seconds = self.earlier + self.start.elapsed().as_secs_f64();
        let (deepest, jamming) = (self.deepest.clone(), jamming.clone());
        let (inherited, reached) = (*inherited, *reached);
        let so_far = SoFar { schedule: *schedule, wall_seconds, deepest, inherited, jamming, reached };
        results.checkpoint(|path| simulation.save(path, &so_far))?;
        (self.checkpointed, self.saved) = (Instant::now(), Some(simulation.step()));
        Ok(())
    }

    /// How to go on with a run that could not write its results.
    pub fn way_on(&self, folder: &Path) -> String {
        match self.saved {
            Some(step) => format!(
                "the last checkpoint is of step {step}: packstone run --resume {} goes on from it",
                folder.display()
            ),
            None => "there is no checkpoint yet".to_owned(),
        }
    }

    /// A row of the history.
    fn record(&mut self) -> packstone::Result<(Sample, Vec<LoadOnWall>)> {
        let sample = self.sample()?;
        let loads = self.simulation.wall_loads()?;
        let outflows = self.simulation.outflows();
        self.results.history(&sample, self.rate(&sample), &loads, &outflows)?;
        self.row = (Instant::now(), Some(sample));
        Ok((sample, loads))
    }

    fn sample(&mut self) -> packstone::Result<Sample> {
        let sample = self.simulation.sample()?;
        Deepest::update(&mut self.deepest, &mut self.simulation, &sample)?;
        Ok(sample)
    }

    /// Particle-steps/s since the row before.
    fn rate(&self, sample: &Sample) -> f64 {
        let (then, last) = &self.row;
        let steps = sample.step - last.as_ref().map_or(self.first, |last| last.step);
        let work = steps as f64 * self.simulation.assembly().grains.len() as f64;
        if work > 0.0 { work / then.elapsed().as_secs_f64() } else { 0.0 }
    }

    /// Why a run cannot go on.
    fn fault(&self, sample: &Sample) -> Option<Error> {
        self.impossible(sample).or_else(|| self.unstable(sample))
    }

    /// Elastic spheres get stiffer the deeper they overlap, beyond what the time step was chosen for.
    fn unstable(&self, sample: &Sample) -> Option<Error> {
        let overlap = sample.max_overlap_over_radius;
        (overlap > self.stable_overlap).then(|| Error::Run {
            step: sample.step,
            time: self.simulation.time(),
            reason: format!(
                "an overlap has grown to {overlap:.3} radii, where contacts are too stiff for solver.dt = {:e} s; at most {:.3} is stable: use \
                 a smaller solver.dt or stiffer grains, or set solver.allow_unstable = true",
                self.simulation.dt(),
                self.stable_overlap
            ),
        })
    }

    /// Sums that are no numbers are no results.
    fn impossible(&self, sample: &Sample) -> Option<Error> {
        let energies = sample.kinetic_energy + sample.potential_energy + sample.elastic_energy + sample.dissipation;
        (!energies.is_finite() || sample.unbalanced_force_ratio.is_nan()).then(|| Error::Run {
            step: sample.step,
            time: self.simulation.time(),
            reason: "energies or forces are no numbers any more; spins, stiffnesses or masses are too large to calculate with"
                .to_owned(),
        })
    }

    fn snapshot(&mut self) -> packstone::Result<()> {
        let grains = self.simulation.grains()?;
        let all = self.simulation.assembly().output.bin || self.results.wants_contacts();
        let clumps = if all { self.simulation.clumps()? } else { Vec::new() };
        let (step, time) = (self.simulation.step(), self.simulation.time());
        let (owners, numbers) = (self.simulation.assembly().owners(), self.simulation.assembly().numbers.clone());
        let moment = Moment { step, time, grains: &grains, clumps: &clumps, owners: &owners, numbers: &numbers };
        if !self.results.wants_contacts() {
            return self.results.snapshot(&moment, None);
        }
        let (walls, contacts) = (self.simulation.walls()?, self.simulation.contacts()?);
        let domain = self.simulation.domain()?;
        let assembly = self.simulation.assembly_in(domain);
        let packing = Packing::new(&assembly, &grains, &clumps, &walls, &contacts);
        self.results.snapshot(&moment, Some(&packing))
    }

    /// Let frames make something of the state. A run does not end because it cannot be drawn.
    fn frame(
        &mut self,
        make: impl FnOnce(&mut Frames, &mut Simulation) -> anyhow::Result<()>,
    ) -> packstone::Result<()> {
        let Some(mut frames) = self.frames.take() else { return Ok(()) };
        let Err(error) = make(&mut frames, &mut self.simulation) else {
            self.frames = Some(frames);
            return Ok(());
        };
        match error.downcast() {
            Ok(error @ Error::Io { .. }) => return Err(error),
            Ok(error) => warn(format!("{error}; there will be no more frames")),
            Err(error) => warn(format!("{error}; there will be no more frames")),
        }
        Ok(())
    }

    /// Whether what the scene waits for has come to its end.
    fn rest(&mut self, sample: &Sample, loads: &[LoadOnWall]) -> packstone::Result<Option<Goal>> {
        let stop = self.simulation.assembly().stop;
        if stop.jamming.is_some() {
            let look = self.jamming.look(&mut self.simulation, sample, self.schedule.history.next())?;
            if look != Look::Moving {
                self.results.jamming(&self.jamming.states)?;
            }
            return Ok((look == Look::Found).then_some(Goal::Jammed));
        }
        Ok(match () {
            () if self.is_at_rest(sample, loads)? => Some(Goal::AtRest),
            () if stop.equilibrium.is_some() && self.simulation.is_unjammed(sample) => Some(Goal::Unjammed),
            () => None,
        })
    }

    /// Whether there is rest, with all that servos are asked for.
    fn is_at_rest(&mut self, sample: &Sample, loads: &[LoadOnWall]) -> packstone::Result<bool> {
        // Rest that grains still to come, or growth, will disturb is none.
        let waits = self.simulation.expects_grains() || self.simulation.is_growing();
        let equilibrium = self.simulation.assembly().stop.equilibrium;
        if waits || !equilibrium.is_some_and(|tolerance| sample.at_rest(tolerance)) {
            return Ok(false);
        }
        let walls = self.simulation.walls()?;
        let assembly = self.simulation.assembly();
        Ok(assembly.missed_stresses(sample.cell.map(|cell| cell.stress())).is_empty()
            && assembly.missed_forces(&walls, loads.iter().map(|load| load.normal_force)).is_empty())
    }

    /// Whether the last step is the one in which given rates bring the cell to a target.
    fn ends_at_target(&self) -> bool {
        let of_target = self.simulation.assembly().time_of_target();
        of_target.map(|time| step_at(time, self.simulation.dt())) == self.schedule.end
    }

    fn has_met_target(&self, sample: &Sample) -> bool {
        let assembly = self.simulation.assembly();
        let met = |cell: CellSample| {
            assembly.has_target_of_servo(cell.strain(), cell.solid_fraction) || assembly.has_pressure(cell.pressure)
        };
        sample.cell.is_some_and(met)
    }

    /// The last state and the summary. Where they cannot be written they go somewhere else.
    pub fn write(mut self, scene: &Scene, end: End) -> packstone::Result<Written> {
        let wall_seconds = self.earlier + self.start.elapsed().as_secs_f64();
        let mut spoilt = None;
        // Before anything is asked of the simulation that could make new lists.
        // Where memory has run out, lists may be half made: the checkpoint before is better.
        let whole = !matches!(end, End::Stopped(Error::Lacking(_)));
        while whole
            && self.simulation.assembly().output.checkpoint > 0.0
            && let Err(error) = self.checkpoint()
        {
            if !matches!(error, Error::Io { .. }) {
                return Err(error);
            }
            // That is the one to report.
            let first = spoilt.unwrap_or(error);
            if self.results.elsewhere().is_err() {
                return Err(first);
            }
            spoilt = Some(first);
        }
        let (step, time) = (self.simulation.step(), self.simulation.time());
        let of_now = self.row.1.filter(|sample| sample.step == step);
        let mut sample = of_now.map_or_else(|| self.sample(), Ok)?;
        if self.simulation.remembers_now() {
            // What has slid in the step before cannot be seen any more.
            sample.dissipation = f64::NAN;
        }
        let loads = self.simulation.wall_loads()?;
        let mut row = match self.schedule.history.past().last() == Some(step) {
            true => None,
            false => Some((self.rate(&sample), self.simulation.outflows())),
        };
        let end = match end {
            End::Reached(Goal::LastStep | Goal::TargetMet) | End::Interrupted => {
                self.fault(&sample).map_or(end, End::Stopped)
            }
            end => end,
        };
        let (converged, stopped) = match &end {
            End::Reached(Goal::Unjammed | Goal::Jammed) => (true, None),
            End::Reached(_) => (self.is_at_rest(&sample, &loads)?, None),
            End::Interrupted => (false, Some(format!("interrupted at step {step}"))),
            End::Stopped(error) => (false, Some(error.to_string())),
        };
        let is_over = matches!(end, End::Reached(_));
        if let Err(error) = self.frame(|frames, simulation| frames.finish(simulation, is_over)) {
            // Whatever becomes of them, the results are written.
            warn(format!("{error}; frames are missing"));
        }
        let (grains, clumps) = (self.simulation.grains()?, self.simulation.clumps()?);
        let target_met = matches!(end, End::Reached(Goal::TargetMet));
        let ended = stopped.clone().unwrap_or_else(|| end.label().to_owned());
        let deepest = self.deepest.take();
        let inherited = self.inherited;
        let states = self.jamming.states.clone();
        let jamming = self.jamming;
        let ending =
            Ending { wall_seconds, converged, target_met, ended: end.label(), stopped, deepest, inherited, jamming };
        let walls = self.simulation.walls()?;
        let totals = self.simulation.contact_totals(&grains, &clumps, &walls)?;
        let state = State { grains: &grains, clumps: &clumps, walls: &walls, totals };
        let summary = Summary::new(scene.name(), &mut self.simulation, &sample, state, ending)?;
        let contacts = if self.results.wants_contacts() { Some(self.simulation.contacts()?) } else { None };
        let domain = self.simulation.domain()?;
        let assembly = self.simulation.assembly_in(domain);
        let packing = contacts.as_ref().map(|all| Packing::new(&assembly, &grains, &clumps, &walls, all));
        let (owners, numbers) = (assembly.owners(), assembly.numbers.clone());
        let moment = Moment { step, time, grains: &grains, clumps: &clumps, owners: &owners, numbers: &numbers };
        let mut results = self.results;
        loop {
            let written =
                row.as_ref().map_or(Ok(()), |(rate, outflows)| results.history(&sample, *rate, &loads, outflows));
            if written.is_ok() {
                row = None;
            }
            let written = written.and_then(|()| if states.is_empty() { Ok(()) } else { results.jamming(&states) });
            let Err(error) = written.and_then(|()| results.finish(&summary, &moment, packing.as_ref())) else { break };
            let first = spoilt.unwrap_or(error);
            if results.elsewhere().is_err() {
                return Err(first);
            }
            spoilt = Some(first);
        }
        let complete = spoilt.is_none() && matches!(end, End::Reached(_));
        let place = results.place().to_owned();
        let (place, unclosed) = match results.close(&ended, complete) {
            Ok(place) => (place, None),
            // All of it is there, but for the last word or the right place.
            Err(error) => (place, Some(error)),
        };
        Ok(Written { summary, end, place, spoilt: spoilt.or(unclosed) })
    }
}
