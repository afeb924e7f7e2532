//! Simulation = scene + plans + engine + state: advances in chunks, replays a chunk that did not fit, and hands out
//! samples and states.

pub mod checkpoint;
mod columns;
mod contacts;
mod dem;
mod grid;
mod host_solver;
mod lists;
mod nscd;
mod options;
pub mod profile;
mod runner;
mod samples;
mod setup;
mod start;
mod stops;
mod works;

pub use crate::measure::Other;
pub use checkpoint::Checkpoint;
pub use columns::Columns;
pub use contacts::ContactHistory;
pub use nscd::{ResidualRecord, SolverStatistics};
pub use options::{EngineChoice, Options};
pub use runner::params_of_step;
pub use setup::Setup;

use crate::{
    engine::{Cpu, Engine, Gpu, programs},
    error::{Error, Result},
    gpu::{Device, selected},
    memory,
    model::{Model, Precision},
    plan::Op,
    plans::Plans,
    scene::{Assembly, Method},
    state::{Array, Params, Sizes, State, array::*, present},
};
use lists::NeighbourLists;
use nscd::Nscd;
use runner::Runner;
use stops::Known;
use works::Totals;

/// A running simulation.
pub struct Simulation {
    assembly: Assembly,
    plans: Plans,
    runner: Runner,
    lists: NeighbourLists,
    stepper: Stepper,
    /// Grains that are not fixed, or clumps.
    free: usize,
    /// Where works are added up.
    works: Option<Totals>,
    /// One line on which engine was taken, and why.
    notice: String,
    dt_bound: f64,
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

/// The state that an engine would have, on the host: the twins run on it whatever precision and order of lists it is in.
fn set_up_on_host(assembly: &Assembly, options: &Options) -> Result<(Setup, Box<dyn Engine>, String)> {
    let setup = Setup::new(assembly, options)?;
    memory::check_host(setup.state.bytes(&setup.state.sizes.of_dense_packing()))?;
    let mut engine: Box<dyn Engine> = Box::new(Cpu::new(setup.state.clone()));
    setup.fill(assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece))?;
    Ok((setup, engine, "on the host".to_owned()))
}

/// Set-up and engine for a choice, and one line that says which engine and why.
fn set_up(assembly: &Assembly, options: &Options) -> Result<(Setup, Box<dyn Engine>, String)> {
    let double = options.precision == Precision::Double;
    let filled = |setup: &Setup, mut engine: Box<dyn Engine>| {
        setup.fill(assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece)).map(|()| engine)
    };
    let on_cpu = |why: &str| -> Result<(Setup, Box<dyn Engine>, String)> {
        let setup = Setup::new(assembly, &Options { engine: EngineChoice::Cpu, ..*options })?;
        let engine = filled(&setup, Box::new(Cpu::new(setup.state.clone())))?;
        let notice = format!("engine cpu (f64, {}): {why}", engine.adapter());
        Ok((setup, engine, notice))
    };
    let on_gpu = || -> Result<(Setup, Box<dyn Engine>, String)> {
        let device = Device::open(options.device())?;
        let passed_over: String = device.passed_over.iter().map(|name| format!("{name} has no f64; ")).collect();
        let asked_for = device.selected || options.engine == EngineChoice::Gpu;
        if device.software && !asked_for {
            let name = &device.summary.name;
            return on_cpu(&format!("{passed_over}{name} is a software driver, and slower; --engine gpu takes it"));
        }
        // The cores behind a software driver read ahead along a list.
        let suitable = if device.software { 1 } else { LISTS_ABREAST };
        let lists_abreast = options.lists_abreast.or(Some(suitable));
        let setup = Setup::new(assembly, &Options { lists_abreast, ..*options })?;
        let gpu = Gpu::new(device, &setup.plans, &setup.state)?;
        let real = if double { "f64" } else { "f32" };
        let why = if asked_for { "asked for" } else { "best adapter found" };
        let notice = format!("engine gpu ({real}, {}): {passed_over}{why}", gpu.adapter());
        let engine = filled(&setup, Box::new(gpu))?;
        Ok((setup, engine, notice))
    };
    let of_host = match assembly.solver.method {
        Method::ContactDynamics(r) if r.solver.is_of_host() => Some(r.solver),
        _ => None,
    };
    if let Some(solver) = of_host {
        return match options.engine {
            EngineChoice::Gpu => {
                Err(Error::Scene(format!("solver.relaxation = \"{}\" runs on the cpu engine only", solver.label())))
            }
            _ => on_cpu(&format!("{} runs there", solver.label())),
        };
    }
    match options.engine {
        EngineChoice::Cpu => on_cpu("asked for"),
        EngineChoice::Gpu => on_gpu(),
        EngineChoice::Auto => match on_gpu() {
            Err(Error::Lacking(why) | Error::Device(why)) if selected().is_none() => on_cpu(&why),
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
    fn build(assembly: Assembly, options: Options) -> Result<Simulation> {
        Simulation::build_on(assembly, options, set_up)
    }

    /// The same on an engine that `set_up` chooses.
    fn build_on(
        mut assembly: Assembly,
        options: Options,
        set_up: impl FnOnce(&Assembly, &Options) -> Result<(Setup, Box<dyn Engine>, String)>,
    ) -> Result<Simulation> {
        assembly.validate()?;
        assembly.fold_ends();
        let (Setup { state, plans, dt_bound }, engine, notice) = set_up(&assembly, &options)?;
        let runner = Runner::new(engine, state, Known::of(&assembly, dt_bound));
        Ok(Simulation {
            lists: NeighbourLists::new(&assembly, &runner.state, &options)?,
            stepper: match assembly.solver.method {
                Method::DiscreteElements => Stepper::Dem,
                Method::ContactDynamics(relaxation) => Stepper::Nscd(Nscd::new(relaxation)),
            },
            free: count_free(&assembly),
            assembly,
            plans,
            runner,
            works: None,
            notice,
            dt_bound,
        })
    }

    /// Back to time 0, without impulses or springs, on an engine that has compiled its kernels already.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn rewind(&mut self) -> Result<()> {
        let Simulation { runner, lists, stepper, assembly, .. } = self;
        lists.rewind(&mut runner.state.params);
        start::fill_small(&mut runner.state, assembly);
        let Runner { engine, state, .. } = runner;
        engine.write(&present(&state.model, &[&WALL]), 0, state)?;
        start::fill(state, assembly, &mut |arrays, first, piece| engine.write(arrays, first, piece))?;
        // Lists without entries leave no history.
        let counted = present(&runner.state.model, &[&LIST_START, &ROTATION_ITERATIONS]);
        runner.execute(&counted.into_iter().map(Op::Clear).collect::<Vec<_>>(), 1)?;
        (runner.step, runner.remembering) = (0, false);
        if let Stepper::Nscd(nscd) = stepper {
            *nscd = Nscd::new(nscd.relaxation);
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
        Ok(())
    }

    /// Advance by this many steps, in chunks.
    ///
    /// # Errors
    /// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
    pub fn advance(&mut self, steps: u64) -> Result<()> {
        let end = self.step() + steps;
        while self.step() < end {
            self.advance_chunk(end - self.step())?;
        }
        Ok(())
    }

    /// One chunk of at most `steps` (at least 1), so that progress can be shown and a run interrupted; returns the
    /// steps done.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance_chunk(&mut self, steps: u64) -> Result<u64> {
        let Simulation { plans, runner, lists, works, .. } = self;
        let steps = works.as_ref().map_or(steps, |works| steps.min(works.steps_left(runner.step)));
        let done = match &mut self.stepper {
            Stepper::Dem => dem::advance(plans, runner, lists, steps)?,
            Stepper::Nscd(nscd) => nscd.advance(plans, runner, lists).map(|()| 1)?,
        };
        if let Some(works) = works {
            works.keep_up(runner, &plans.forget_works)?;
        }
        Ok(done)
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
            return Ok(gpu.bytes() as f64 / s.sizes.bodies as f64);
        }
        let layouts = programs::layouts(&s.model, &self.plans)?;
        let total: u64 = programs::bytes(&s.model, &layouts, &self.sizes()).map(|(_, b)| b).sum();
        Ok(total as f64 / s.sizes.bodies as f64)
    }

    pub fn assembly(&self) -> &Assembly {
        &self.assembly
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
    /// What positions are multiples of, m; None in double precision. It grows with the distance of the grains from the
    /// origin.
    pub fn position_quantum(&self) -> Option<f64> {
        (self.model().precision == Precision::Single).then_some(self.params().quantum)
    }
    /// The overlap over the radius up to which the time step is below the bound. Infinite for springs; that of elastic
    /// spheres follows from the overlaps they have come to.
    pub fn stable_overlap(&self) -> f64 {
        crate::time_step::stable_overlap(&self.assembly, self.dt())
    }
    pub fn step(&self) -> u64 {
        self.runner.step
    }
    /// s
    pub fn time(&self) -> f64 {
        self.step() as f64 * self.dt()
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
