//! Simulation = scene + plans + engine + state: advances in chunks, replays a chunk that did not fit, and hands out
//! samples and states.

mod change;
pub mod checkpoint;
mod columns;
mod contacts;
mod dem;
mod driven;
mod grid;
mod growth;
mod host_solver;
mod lists;
mod nscd;
mod openings;
mod options;
mod overlaps;
pub mod profile;
mod runner;
mod samples;
mod setup;
mod start;
mod stops;
mod successor;
mod turnover;
mod works;

pub use crate::measure::Other;
pub use checkpoint::Checkpoint;
pub use columns::Columns;
pub use contacts::ContactHistory;
pub use nscd::{ResidualRecord, SolverStatistics};
pub use openings::{Inlet, Outflow, Outlet};
pub use options::{EngineChoice, Options};
pub use overlaps::{DEEP_OVERLAP, DEEPER, DeepOverlap};
pub use runner::params_of_step;
pub use setup::Setup;
pub use successor::{StageRun, Successor};

use crate::{
    engine::{Cpu, Engine, Gpu, programs},
    error::{Error, Result},
    gpu::{Device, selected},
    model::{Model, Precision},
    plan::Op,
    plans::Plans,
    scene::{Assembly, Domain, GrowthLaw, Method},
    state::{Array, Params, Sizes, State, array::*, present},
};
use std::borrow::Cow;

use lists::NeighbourLists;
use nscd::Nscd;
use openings::Openings;
use runner::Runner;
use start::Guides;
use stops::Known;
use works::Totals;

/// A running simulation.
pub struct Simulation {
    assembly: Assembly,
    plans: Plans,
    runner: Runner,
    lists: NeighbourLists,
    stepper: Stepper,
    /// Where grains come in and leave.
    openings: Option<Openings>,
    /// Grains that are not fixed, or clumps.
    free: usize,
    /// How radii change, if any does.
    growth: Option<GrowthLaw>,
    /// Where works are added up.
    works: Option<Totals>,
    /// The deepest overlap of the steps so far, if it is more than [`DEEP_OVERLAP`].
    deep_overlap: Option<DeepOverlap>,
    /// One line on which engine was taken, and why.
    notice: String,
    dt_bound: f64,
    /// How far servos may move their walls, m.
    longest_ways: Vec<f64>,
}

/// Lists that lie side by side on a GPU: as many as most have lanes in a warp.
pub const LISTS_ABREAST: u32 = 32;

/// Grains that are not fixed, or clumps.
fn count_free(assembly: &Assembly) -> usize {
    match &assembly.clumps[..] {
        [] => assembly.grains.iter().filter(|grain| !grain.fixed).count(),
        clumps => clumps.iter().filter(|clump| !clump.fixed).count(),
    }
}

/// How steps are done.
enum Stepper {
    Dem,
    Nscd(Nscd),
}

/// What a simulation will run on, and why.
enum Chosen {
    Cpu(String),
    Gpu(Box<Device>, String),
}

/// What the options come to for a scene on this machine.
fn choose(assembly: &Assembly, options: &Options) -> Result<Chosen> {
    let of_host = match assembly.solver.method {
        Method::ContactDynamics(r) if r.solver.is_of_host() => Some(r.solver.label()),
        _ => None,
    };
    let on_gpu = || -> Result<Chosen> {
        let device = Device::open(options.device())?;
        let passed_over: String = device.passed_over.iter().map(|name| format!("{name} has no f64; ")).collect();
        let asked_for = device.selected || options.engine == EngineChoice::Gpu;
        if device.software && !asked_for {
            let name = &device.summary.name;
            let why = format!("{passed_over}{name} is a software driver, and slower; --engine gpu takes it");
            return Ok(Chosen::Cpu(why));
        }
        let why = format!("{passed_over}{}", if asked_for { "asked for" } else { "best adapter found" });
        Ok(Chosen::Gpu(Box::new(device), why))
    };
    match (options.engine, of_host) {
        (EngineChoice::Gpu, Some(solver)) => {
            Err(Error::Scene(format!("solver.relaxation = \"{solver}\" runs on the cpu engine only")))
        }
        (_, Some(solver)) => Ok(Chosen::Cpu(format!("{solver} runs there"))),
        (EngineChoice::Cpu, None) => Ok(Chosen::Cpu("asked for".to_owned())),
        (EngineChoice::Gpu, None) => on_gpu(),
        (EngineChoice::Auto, None) => match on_gpu() {
            Err(Error::Lacking(why) | Error::Device(why)) if selected().is_none() => Ok(Chosen::Cpu(why)),
            chosen => chosen,
        },
    }
}

/// The engine that a scene will run on here, unless its device proves too small.
///
/// # Errors
/// As [`Simulation::new`] where no engine will do.
pub fn engine_of(assembly: &Assembly, options: &Options) -> Result<EngineChoice> {
    Ok(match choose(assembly, options)? {
        Chosen::Cpu(_) => EngineChoice::Cpu,
        Chosen::Gpu(..) => EngineChoice::Gpu,
    })
}

/// An engine with the grains at time 0.
fn filled(assembly: &Assembly, setup: &Setup, mut engine: Box<dyn Engine>) -> Result<Box<dyn Engine>> {
    if assembly.changes() {
        let large = assembly.whole().largest_common_radius();
        engine.count(&setup::counted(assembly, large, &setup.state.sizes, &setup.state.params).0)?;
    }
    setup.fill(assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece))?;
    Ok(engine)
}

/// Set-up and engine for a choice, and one line that says which engine and why.
fn set_up(assembly: &Assembly, options: &Options) -> Result<(Setup, Box<dyn Engine>, String)> {
    let on_cpu = |why: String| -> Result<(Setup, Box<dyn Engine>, String)> {
        let setup = Setup::new(assembly, &Options { engine: EngineChoice::Cpu, ..*options })?;
        let engine = filled(assembly, &setup, Box::new(Cpu::new(setup.state.clone())?))?;
        let notice = format!("engine cpu (f64, {}): {why}", engine.adapter());
        Ok((setup, engine, notice))
    };
    let on_gpu = |device: Device, why: String| -> Result<(Setup, Box<dyn Engine>, String)> {
        // The cores behind a software driver read ahead along a list.
        let suitable = if device.software { 1 } else { LISTS_ABREAST };
        let lists_abreast = options.lists_abreast.or(Some(suitable));
        let setup = Setup::new(assembly, &Options { lists_abreast, engine: EngineChoice::Gpu, ..*options })?;
        let gpu = Gpu::new(device, &setup.plans, &setup.state)?;
        let real = if options.precision == Precision::Double { "f64" } else { "f32" };
        let notice = format!("engine gpu ({real}, {}): {why}", gpu.adapter());
        let engine = filled(assembly, &setup, Box::new(gpu))?;
        Ok((setup, engine, notice))
    };
    match choose(assembly, options)? {
        Chosen::Cpu(why) => on_cpu(why),
        Chosen::Gpu(device, why) => match on_gpu(*device, why) {
            Err(Error::Lacking(why) | Error::Device(why))
                if options.engine == EngineChoice::Auto && selected().is_none() =>
            {
                on_cpu(why)
            }
            result => result,
        },
    }
}

impl Simulation {
    /// Build a scene and bring it to time 0.
    ///
    /// # Errors
    /// [`Error::Scene`] for what [`Assembly::validate`] refuses and for a time step above the bound, [`Error::Lacking`] if there is
    /// no adapter or not enough memory.
    pub fn new(assembly: Assembly, options: Options) -> Result<Simulation> {
        let mut simulation = Simulation::build(assembly, options)?;
        simulation.start()?;
        Ok(simulation)
    }

    /// Everything but the first lists.
    fn build(mut assembly: Assembly, options: Options) -> Result<Simulation> {
        assembly.validate()?;
        assembly.fold_ends();
        let (setup, engine, notice) = set_up(&assembly, &options)?;
        Simulation::of_parts(assembly, options, setup, engine, notice)
    }

    fn of_parts(
        assembly: Assembly,
        options: Options,
        Setup { mut state, plans, dt_bound }: Setup,
        engine: Box<dyn Engine>,
        notice: String,
    ) -> Result<Simulation> {
        let mut assembly = assembly;
        let openings = assembly.changes().then(|| Openings::new(&mut assembly, state.params.dt));
        if let Some(openings) = &openings {
            (state.sizes, state.params) = openings.counted(&assembly, &state.sizes, &state.params);
        }
        let whole = assembly.whole();
        let growth = assembly.growth_law();
        let guides = Guides::of(&whole, growth.clone());
        let servos = if state.model.driven_walls { whole.walls.len() } else { 0 };
        let longest_ways = (0..servos).map(|wall| whole.longest_way(wall)).collect();
        let runner = Runner::new(engine, state, Known::of(&whole, dt_bound), guides);
        let lists = NeighbourLists::new(&whole, &runner.state, &options)?;
        drop(whole);
        Ok(Simulation {
            lists,
            openings,
            stepper: match assembly.solver.method {
                Method::DiscreteElements => Stepper::Dem,
                Method::ContactDynamics(relaxation) => Stepper::Nscd(Nscd::new(relaxation, options.interrupted)),
            },
            free: count_free(&assembly),
            growth,
            assembly,
            plans,
            runner,
            works: None,
            deep_overlap: None,
            notice,
            dt_bound,
            longest_ways,
        })
    }

    /// Back to time 0, without impulses or springs, on an engine that has compiled its kernels already.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn rewind(&mut self) -> Result<()> {
        self.close_openings()?;
        let Simulation { runner, lists, stepper, assembly, .. } = self;
        lists.rewind(&mut runner.state.params);
        start::fill_small(&mut runner.state, &assembly.whole(), self.growth.clone());
        let Runner { engine, state, .. } = runner;
        engine.write(&present(&state.model, &[&WALL, &CELL]), 0, state)?;
        start::fill(state, assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece))?;
        // Lists without entries leave no history.
        let counted = present(&runner.state.model, &[&LIST_START, &ROTATION_ITERATIONS]);
        runner.execute(&counted.into_iter().map(Op::Clear).collect::<Vec<_>>(), 1)?;
        (runner.step, runner.remembering, runner.springs_of_now) = (0, false, false);
        self.deep_overlap = None;
        if let Stepper::Nscd(nscd) = stepper {
            *nscd = Nscd::new(nscd.relaxation, nscd.interrupted);
        }
        self.start()
    }

    /// Lists, and velocities half a step back.
    fn start(&mut self) -> Result<()> {
        let speed = self.assembly.grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
        let displacement_per_step = speed * self.dt();
        self.lists.start(&self.plans, &mut self.runner, displacement_per_step)?;
        self.runner.execute_plan(&self.plans.start)?;
        self.works = None;
        if self.model().works {
            let sample = self.sample()?;
            self.works = Some(Totals::start(&mut self.runner, &self.plans.forget_works, &sample)?);
        }
        self.open()
    }

    /// Advance by this many steps, in chunks; by fewer if a step is given up.
    ///
    /// # Errors
    /// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
    pub fn advance(&mut self, steps: u64) -> Result<()> {
        let end = self.step() + steps;
        while self.step() < end && self.advance_chunk(end - self.step())? > 0 {}
        Ok(())
    }

    /// One chunk of at most `steps` (at least 1), so that progress can be shown and a run interrupted; returns the
    /// steps done: none if one was given up because it was interrupted, and the state is what it was before.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance_chunk(&mut self, steps: u64) -> Result<u64> {
        let steps = steps.min(self.steps_to_opening());
        let Simulation { plans, runner, lists, works, .. } = self;
        let steps = works.as_ref().map_or(steps, |works| steps.min(works.steps_left(runner.step)));
        let done = match &mut self.stepper {
            Stepper::Dem => dem::advance(plans, runner, lists, steps),
            Stepper::Nscd(nscd) => nscd.advance(plans, runner, lists).map(u64::from),
        };
        let done = match done {
            Err(error) if self.runner.springs_of_now && self.works.is_some() => {
                // They have been added up for the step that was taken back, too.
                let sample = self.sample()?;
                self.works.iter_mut().for_each(|works| works.take_back(&self.runner, &sample));
                return Err(error);
            }
            done => done?,
        };
        let Simulation { plans, runner, works, .. } = self;
        if let Some(works) = works {
            works.keep_up(runner, &plans.forget_works)?;
        }
        self.follow_driven_walls()?;
        self.check_room_to_grow()?;
        if std::mem::take(&mut self.runner.overlaps_deeply) {
            self.look_at_deep_overlap()?;
        }
        if done > 0 {
            self.open()?;
        }
        Ok(done)
    }

    /// A step was the last of its chunk because of an overlap: which it is.
    fn look_at_deep_overlap(&mut self) -> Result<()> {
        let step = self.step();
        let seen = self.params().deep_overlap;
        let found = self.deepest_overlap_of_step()?.filter(|found| found.over_radius >= seen);
        let deepest = found.unwrap_or(DeepOverlap { over_radius: seen, step, pair: None });
        self.runner.state.params.deep_overlap = DEEPER * deepest.over_radius;
        self.deep_overlap = Some(deepest);
        Ok(())
    }

    /// From now on a step of contact dynamics may take this many passes.
    pub fn limit_passes(&mut self, most: u32) {
        if let Stepper::Nscd(nscd) = &mut self.stepper {
            nscd.relaxation.max_iterations = most.max(1);
        }
    }

    /// The residual of the last step as its relaxation went on; the last entry is what it ended with.
    pub fn residual_history(&self) -> &[ResidualRecord] {
        if let Stepper::Nscd(nscd) = &self.stepper { &nscd.residual_history } else { &[] }
    }

    /// How the contacts have been solved so far; None outside of contact dynamics.
    pub fn solver_statistics(&self) -> Option<&SolverStatistics> {
        if let Stepper::Nscd(nscd) = &self.stepper { Some(&nscd.statistics) } else { None }
    }

    /// The host's copy of these arrays, read now.
    pub fn read(&mut self, arrays: &[&'static Array]) -> Result<&State> {
        self.runner.read(arrays)
    }

    /// Those of the engine's arrays.
    fn sizes(&self) -> Sizes {
        let (entries, history) = (self.lists.entries(), self.lists.history().0);
        Sizes { entries, history, ..self.runner.state.sizes }
    }

    /// Bytes per grain of all arrays as they are now; on the CPU engine those that a device would need that shares none.
    pub fn bytes_per_particle(&self) -> Result<f64> {
        let s = &self.runner.state;
        if let Some(gpu) = self.engine().gpu() {
            return Ok(gpu.bytes() as f64 / s.sizes.bodies.max(1) as f64);
        }
        let layouts = programs::layouts(&s.model, &self.plans)?;
        let total: u64 = programs::bytes(&s.model, &layouts, &self.sizes()).map(|(_, b)| b).sum();
        Ok(total as f64 / s.sizes.bodies.max(1) as f64)
    }

    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }
    /// The scene with its cell as it is now, see [`Simulation::domain`], and with the radii of now.
    pub fn assembly_in(&self, domain: Domain) -> Cow<'_, Assembly> {
        match self.assembly_now() {
            Cow::Borrowed(assembly) => assembly.within(domain),
            Cow::Owned(assembly) => Cow::Owned(Assembly { domain, ..assembly }),
        }
    }
    pub fn model(&self) -> &Model {
        &self.runner.state.model
    }
    pub fn engine(&self) -> &dyn Engine {
        self.runner.engine.as_ref()
    }
    /// One line: which engine was taken, and why.
    pub fn notice(&self) -> &str {
        &self.notice
    }
    pub(crate) fn params(&self) -> &Params {
        &self.runner.state.params
    }
    /// s
    pub fn dt(&self) -> f64 {
        self.runner.state.params.dt
    }
    /// s
    pub fn dt_bound(&self) -> f64 {
        self.dt_bound
    }
    /// What positions are multiples of, low parts included, m; None in double precision. It grows with the distance of
    /// the grains from the origin.
    pub fn position_quantum(&self) -> Option<f64> {
        // The unit in the last place of the largest low part, half a quantum.
        (self.model().precision == Precision::Single).then_some(self.params().quantum * 2.0_f64.powi(-25))
    }
    /// The overlap over the radius up to which the time step is below the bound. Infinite for springs; that of elastic
    /// spheres follows from the overlaps they have come to.
    pub fn stable_overlap(&self) -> f64 {
        crate::time_step::stable_overlap(&self.assembly, self.dt())
    }
    /// The deepest overlap of the steps so far, if it is more than [`DEEP_OVERLAP`]; no step had one that was deeper by
    /// more than a quarter. What was before a checkpoint is not known here.
    pub fn deep_overlap(&self) -> Option<&DeepOverlap> {
        self.deep_overlap.as_ref()
    }
    pub fn step(&self) -> u64 {
        self.runner.step
    }
    /// s
    pub fn time(&self) -> f64 {
        self.step() as f64 * self.dt()
    }
    /// Whether what contacts remember is of this step, and not of the one before: it is after a step of the discrete element
    /// method was taken back, which has lost a grain.
    pub fn remembers_now(&self) -> bool {
        self.runner.springs_of_now
    }
    /// Chunks that were done again with longer lists, or ended early because a grain came to the end of the lists'
    /// reach.
    pub fn replayed_chunks(&self) -> u64 {
        self.lists.repeated_chunks()
    }
    /// Contacts whose history got lost when lists were made anew: 0, or a defect.
    pub fn lost_contacts(&self) -> u64 {
        self.lists.lost_contacts()
    }
}
