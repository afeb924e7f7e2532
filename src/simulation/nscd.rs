//! A step of contact dynamics: passes over the contacts until their residual is small enough.

use super::{
    host_solver,
    lists::{NeighbourLists, resize},
    runner::Runner,
};
use crate::{
    engine::ALL,
    error::{Error, Result},
    nscd::coloring::Coloring,
    plan::{Driver, Loop, Op},
    plans::Plans,
    record::record,
    scene::Relaxation,
    state::{ARRAYS, Array, Length, Lifetime, Sizes, SolverState, State, array, present},
};
use std::time::{Duration, Instant};

/// Fewest and most passes that are begun without a look at the residual.
const LEAST_AT_ONCE: u32 = 4;
const MOST_AT_ONCE: u32 = 256;

/// By colours velocities gather rounding until the residual is computed, and momentum adds it up twice: in single
/// precision it would stay above 5e-4.
const MOST_BY_COLORS: u32 = 16;
/// The same for sweeps over a colour, of which a pass has as many as there are colours: a grain may have hundreds of
/// contacts.
const MOST_SWEEPS: u32 = 8192;

/// A residual has fallen since an earlier look if it is less than this part of what it was.
const FALLEN: f64 = 0.7;
/// Passes without a fall after which there may be none any more.
const PATIENCE: u32 = 16;

/// In a step that may take longer than [`SLOW`], it is asked about as often whether to give it up.
const PAUSE: Duration = Duration::from_millis(250);
const SLOW: Duration = Duration::from_millis(500);

/// What can be given up has to be kept as it was before, which may take this part of a step.
const CHEAP: f64 = 0.1;

/// Most solutions of a step on the host, each with the pairs that the one before has brought together.
const HOST_ROUNDS: u32 = 16;

record!(
    /// How the contacts of the steps so far have been solved.
    SolverStatistics {
        steps: u64,
        /// Steps that ended with a residual above the tolerance that is not the rounding of loads.
        unconverged: u64,
        /// Passes of all steps, and of the last one.
        iterations: u64,
        last_iterations: u32,
        /// Largest residual of a contact, by the natural map and relative to what acts on it: sum over the steps,
        /// largest, and of the last one.
        residual_sum: f64,
        residual_max: f64,
        last_residual: f64,
        /// Whether the last step was left unsolved.
        last_unsolved: bool,
        /// Largest friction beyond the Coulomb limit over the largest normal impulse, of the last step.
        last_excess: f64,
        /// Solvers that solve contacts one by one: updates that found no solution.
        local_failures: u64,
        /// Passes after which the residual of the last step fell no more.
        last_useful_iterations: u32,
    }
);

impl SolverStatistics {
    fn add(&mut self, passes: u32, end: &SolverState, solved: bool) {
        let residual = end.residual;
        self.steps += 1;
        self.unconverged += u64::from(!solved);
        self.last_unsolved = !solved;
        self.iterations += u64::from(passes);
        self.residual_sum += residual;
        self.residual_max = if residual.is_nan() { f64::INFINITY } else { self.residual_max.max(residual) };
        (self.last_iterations, self.last_residual, self.last_excess) = (passes, residual, end.coulomb_excess);
    }
}

/// The residual after some passes of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualRecord {
    /// Passes so far.
    pub passes: u32,
    /// Largest residual of a contact, by the natural map and relative to what acts on it.
    pub residual: f64,
    /// Wall time since contacts were looked for in the lists, s.
    pub seconds: f64,
}

/// Steps of contact dynamics.
pub struct Nscd {
    pub relaxation: Relaxation,
    pub statistics: SolverStatistics,
    /// Of the last step; the last entry is what it ended with.
    pub residual_history: Vec<ResidualRecord>,
    pub interrupted: fn() -> bool,
    /// Whether the next step is one that can be given up.
    keeps_before: bool,
    /// How long it took to keep what was there before a step.
    kept_in: Duration,
}

impl Nscd {
    pub fn new(relaxation: Relaxation, interrupted: fn() -> bool) -> Nscd {
        let statistics = SolverStatistics::default();
        let residual_history = Vec::new();
        // Of the first step nothing is known.
        Nscd { relaxation, statistics, residual_history, interrupted, keeps_before: true, kept_in: Duration::ZERO }
    }

    /// One step: whether it is done. If not it was interrupted, and nothing has changed.
    ///
    /// # Errors
    /// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
    pub fn advance(&mut self, plans: &Plans, runner: &mut Runner, lists: &mut NeighbourLists) -> Result<bool> {
        let begin = Instant::now();
        lists.see_walls(runner.guide(1)?);
        let mut step = Step::new(self, runner, lists);
        let walked = plans.chunk.walk(&mut step);
        if let Some(before) = step.before.take_if(|_| step.given_up) {
            before.put_back(runner)?;
            return Ok(false);
        }
        walked?;
        let (passes, end, solved, best) = (step.passes, step.end, step.solved, step.best);
        self.statistics.local_failures += step.local_failures;
        self.statistics.last_useful_iterations = best.1;
        self.statistics.add(passes, &end, solved);
        lists.serve_step();
        runner.step += 1;
        self.keeps_before = self.may_take_long(begin.elapsed(), passes);
        Ok(true)
    }

    /// Whether the step after one that took so long and so many passes is to be kept: an impact may make it as many passes
    /// as it may have.
    fn may_take_long(&self, took: Duration, passes: u32) -> bool {
        let longest = took.as_secs_f64() * f64::from(self.relaxation.max_iterations) / f64::from(passes.max(1));
        took >= SLOW || longest >= SLOW.as_secs_f64() && self.kept_in.as_secs_f64() <= CHEAP * took.as_secs_f64()
    }
}

/// What the passes of a step change of the state, as it was before.
struct Before {
    sizes: Sizes,
    arrays: Vec<&'static Array>,
    content: State,
}

impl Before {
    /// With new lists, if there are to be any, and before anything of the step.
    fn of(runner: &mut Runner) -> Result<Before> {
        let s = &runner.state;
        let changes = |array: &&'static Array| {
            let of_contacts = matches!(array.length, Length::Entries | Length::Colors | Length::One);
            array.lifetime == Lifetime::State && of_contacts
        };
        let arrays: Vec<_> = present(&s.model, ARRAYS).into_iter().filter(changes).collect();
        let mut before = Before { sizes: s.sizes, content: State::bare(s.model, s.sizes, s.params), arrays };
        runner.engine.read(&before.arrays, ALL, &mut before.content)?;
        Ok(before)
    }

    fn put_back(self, runner: &mut Runner) -> Result<()> {
        runner.forget_queue();
        for kind in [Length::Contacts, Length::Colors] {
            if runner.state.sizes.of(kind) != self.sizes.of(kind) {
                resize(runner, kind, self.sizes.of(kind))?;
            }
        }
        runner.state.sizes = self.sizes;
        runner.engine.write(&self.arrays, 0, &self.content)
    }
}

/// Walks the plan of a step.
struct Step<'a> {
    nscd: &'a mut Nscd,
    runner: &'a mut Runner,
    lists: &'a mut NeighbourLists,
    on_host: bool,
    began: Instant,
    /// Passes so far, and those to do before the next look.
    passes: u32,
    batch: u32,
    /// What the last look has seen.
    end: SolverState,
    /// Whether that is a solution.
    solved: bool,
    /// The least residual that a look has seen, after so many passes.
    best: (f64, u32),
    coloring: Coloring,
    /// Updates of the host's solver that found no solution.
    local_failures: u64,
    /// Why the step is taken back, if it lost a grain.
    lost: Option<Error>,
    /// To go back to, of a step that may take long.
    before: Option<Before>,
    given_up: bool,
}

impl<'a> Step<'a> {
    fn new(nscd: &'a mut Nscd, runner: &'a mut Runner, lists: &'a mut NeighbourLists) -> Step<'a> {
        Step {
            on_host: nscd.relaxation.solver.is_of_host(),
            began: Instant::now(),
            passes: 0,
            batch: 0,
            end: SolverState::default(),
            solved: false,
            best: (f64::INFINITY, 0),
            coloring: Coloring::default(),
            local_failures: 0,
            lost: None,
            before: None,
            given_up: false,
            nscd,
            runner,
            lists,
        }
    }

    /// Begin, or begin anew.
    fn begin(&mut self) {
        self.nscd.residual_history.clear();
        self.local_failures = 0;
        // That of a step that was taken back.
        self.runner.overlaps_deeply = false;
        self.began = Instant::now();
        self.passes = 0;
        // Most steps take about as many passes as the one before; to learn of fewer, begin with fewer.
        self.batch = (self.nscd.statistics.last_useful_iterations * 3 / 4).clamp(LEAST_AT_ONCE, MOST_AT_ONCE);
        self.end = SolverState { residual: f64::INFINITY, ..SolverState::default() };
        self.best = (f64::INFINITY, 0);
        self.coloring = Coloring::default();
    }
}

impl Driver for Step<'_> {
    fn run(&mut self, op: Op) -> Result<()> {
        self.runner.push(op);
        Ok(())
    }

    fn solve_on_host(&mut self) -> Result<()> {
        self.runner.submit()?;
        let passes = self.passes;
        let left = Relaxation { max_iterations: self.nscd.relaxation.max_iterations - passes, ..self.nscd.relaxation };
        let interrupted = if self.before.is_some() { self.nscd.interrupted } else { || false };
        let solution = host_solver::solve_step(self.runner, &left, self.began, interrupted)?;
        self.local_failures += solution.local_failures as u64;
        self.nscd.residual_history.extend(solution.history.iter().map(|record| ResidualRecord {
            passes: passes + record.pass as u32,
            residual: record.residual,
            seconds: record.seconds,
        }));
        self.passes += solution.passes as u32;
        Ok(())
    }

    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32> {
        match (of, done) {
            (Loop::UntilStepIsWithinLists, done) => self.is_within_lists(done).map(|within| u32::from(!within)),
            (Loop::IfStepIsTakenBack, 0) => self.has_left_lists().map(u32::from),
            (Loop::IfListsAreUsedUp, 0) => self.lists_are_used_up().map(u32::from),
            (Loop::UntilListsFit, 0) => self.lists.make_room(self.runner).map(|()| 1),
            (Loop::UntilListsFit, done) => match self.lists.are_made(self.runner, done)? {
                Some(counters) => {
                    self.began = Instant::now();
                    self.runner.check_lost(&counters).map(|()| 0)
                }
                None => Ok(1),
            },
            (Loop::IfListsAreNew, 0) => Ok(u32::from(self.lists.are_new())),
            (Loop::Times(n), 0) => Ok(n),
            (Loop::UntilSolved, 0) => self.keep().map(|()| 1),
            (Loop::UntilColored, 0) => Ok(1),
            (Loop::UntilSolved, done) => self.is_solved(done).map(|solved| u32::from(!solved)),
            // Those that the step begins with, and those that the last look has found.
            (Loop::IfContactsAreNew, 0) => Ok(u32::from(self.passes == 0 || self.end.late_contacts > 0)),
            (Loop::UntilColored, _) => self.is_colored().map(|colored| u32::from(!colored)),
            (Loop::IfColorsDoNotFit, 0) => Ok(u32::from(self.coloring.too_short)),
            (Loop::ForEachColor, 0) => Ok(self.coloring.colors),
            (Loop::Passes, done) => self.passes_to_do(done),
            _ => Ok(0),
        }
    }
}

impl Step<'_> {
    /// Whether the step, if it has been done already, has stayed within the lists.
    ///
    /// # Errors
    /// [`Error::Run`] if it has lost a grain; it has been taken back then.
    fn is_within_lists(&mut self, done: u32) -> Result<bool> {
        self.runner.submit()?;
        if let Some(reason) = self.lost.take() {
            self.lists.discard();
            return Err(reason);
        }
        let within = done > 0 && !self.lists.margin_is_used_up();
        if !within {
            if done > 0 {
                self.lists.repeat_step();
            }
            self.begin();
        }
        Ok(within)
    }

    /// Look at where the step has ended: whether that is beyond the reach of the lists, or a grain is lost.
    fn has_left_lists(&mut self) -> Result<bool> {
        self.runner.submit()?;
        let counters = self.runner.engine.counters()?;
        self.lists.note_displacements(&counters, &self.runner.state.params);
        self.runner.overlaps_deeply = counters.deep_overlaps > 0;
        if counters.narrow_cell > 0 {
            self.lost = Some(self.runner.narrow_cell(self.runner.step)?);
        }
        if counters.lost_body > 0 {
            self.lost = Some(self.runner.lost_grain(counters.lost_body, self.runner.step)?);
        }
        Ok(self.lost.is_some() || self.lists.margin_is_used_up())
    }

    /// Whether new ones have to be made; then they get room.
    fn lists_are_used_up(&mut self) -> Result<bool> {
        let used_up = self.lists.are_used_up();
        if used_up {
            self.lists.set_margin(&mut self.runner.state.params);
            // Positions may be multiples of more now.
            self.runner.guide(1)?;
            self.lists.make_room_for_history(self.runner)?;
        }
        Ok(used_up)
    }

    /// Before the first pass, of which nothing has been submitted yet.
    fn keep(&mut self) -> Result<()> {
        if self.nscd.keeps_before {
            let begin = Instant::now();
            self.before = Some(Before::of(self.runner)?);
            self.nscd.kept_in = begin.elapsed();
        }
        Ok(())
    }

    /// Whether the step is to be given up is an error, which ends its plan.
    fn check_interrupt(&mut self) -> Result<()> {
        self.given_up = self.before.is_some() && (self.nscd.interrupted)();
        if self.given_up { Err(Error::Device("the step was interrupted".to_owned())) } else { Ok(()) }
    }

    /// Passes to do before the next look, or before the next moment at which the step may be given up.
    fn passes_to_do(&mut self, done: u32) -> Result<u32> {
        let left = self.passes_at_once() - done;
        if self.before.is_none() || left == 0 {
            return Ok(left);
        }
        if done > 0 {
            self.runner.submit()?;
            // What is read has been computed.
            self.runner.read(&[&array::SOLVER_STATE])?;
            self.check_interrupt()?;
        }
        let per_pass = self.began.elapsed().as_secs_f64() / f64::from((self.passes + done).max(1));
        let at_once = if self.passes + done == 0 { 1 } else { (PAUSE.as_secs_f64() / per_pass) as u32 };
        Ok(left.min(at_once.max(1)))
    }

    /// Passes to do before the next look.
    fn passes_at_once(&self) -> u32 {
        let batch = self.batch.min(self.nscd.relaxation.max_iterations - self.passes);
        if !self.runner.state.model.colored {
            return batch;
        }
        batch.min(MOST_BY_COLORS).min((MOST_SWEEPS / self.coloring.colors.max(1)).max(1))
    }

    /// Look at the residual: whether that is it. `round`: how many looks there have been.
    fn is_solved(&mut self, round: u32) -> Result<bool> {
        self.runner.submit()?;
        let before = (self.passes, self.end.residual);
        self.end = self.runner.read(&[&array::SOLVER_STATE])?.solver_state[0];
        self.check_interrupt()?;
        let SolverState { residual, resolved_residual, late_contacts, .. } = self.end;
        if !self.on_host {
            self.passes = self.end.passes;
        }
        let seconds = self.began.elapsed().as_secs_f64();
        self.nscd.residual_history.push(ResidualRecord { passes: self.passes, residual, seconds });
        let tolerance = self.runner.state.params.tolerance;
        if late_contacts > 0 || !(residual >= FALLEN * self.best.0) {
            self.best = (residual, self.passes);
        }
        // What falls no more and is rounding will not fall.
        let stalled = self.passes >= self.best.1 + (self.best.1 / 2).max(PATIENCE);
        self.solved = residual <= tolerance || (stalled && resolved_residual <= tolerance);
        if self.solved || self.passes >= self.nscd.relaxation.max_iterations {
            return Ok(true);
        }
        if self.on_host {
            // Pairs that were left out may have met; then once more, with them.
            return Ok(late_contacts == 0 || round == HOST_ROUNDS);
        }
        // As many as it takes if the residual goes on falling as it has since the last look, but no more than a quarter
        // of what there were.
        let fall = (before.1 / residual).ln() / f64::from(self.passes - before.0);
        let needed = (residual / tolerance).ln() / fall;
        let needed = if needed > 0.0 { needed.ceil() as u32 } else { u32::MAX };
        self.batch = needed.min(self.passes / 4).clamp(LEAST_AT_ONCE, MOST_AT_ONCE);
        Ok(residual.is_nan())
    }

    /// Look at the colours: whether all contacts have one.
    fn is_colored(&mut self) -> Result<bool> {
        self.runner.submit()?;
        let seen = self.runner.read(&[&array::COLORING_STATE])?.coloring_state[0];
        let colored = self.coloring.look(&seen, &mut self.runner.state.sizes)?;
        if self.coloring.too_short {
            for kind in [Length::Contacts, Length::Colors] {
                resize(self.runner, kind, self.runner.state.sizes.of(kind))?;
            }
        }
        Ok(colored)
    }
}
