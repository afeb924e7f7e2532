//! CPU and GPU side by side, stage by stage.
//!
//! The device's state drives. Before each stage both engines hold the same numbers (what the device holds is exact in
//! f64); both run the stage; what the device wrote is compared with what the twin wrote, and then adopted by the twin.
//! So every row of the report is the rounding of one stage, not the drift of a trajectory.

pub mod balance;
mod compare;
mod rules;

use crate::{
    contact::overlap::deepest,
    engine::{ALL, Engine, Gpu, cpu::apply},
    error::Result,
    measure::Sample,
    model::{Method, Precision},
    nscd::coloring::Coloring,
    plan::{Driver, Loop, Op},
    scene::{Assembly, Grain},
    simulation::{EngineChoice, Options, Setup, Simulation, params_of_step},
    stage::{Stage, Tolerance},
    state::{ARRAYS, Array, HALTED, Length, State, array::*, present},
};
use balance::balances;
use compare::{compare, undecided};
use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;

/// The outcome of a check.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub adapter: String,
    pub precision: &'static str,
    /// Steps compared, and steps done before the comparison began.
    pub steps: u64,
    pub after: u64,
    /// Largest number of contacts seen: a check without contacts checks little.
    pub contacts: u64,
    pub rows: Vec<Row>,
    /// How far both engines drift apart when they run the same steps freely, largest distance over mean radius. For
    /// information: in a collision every difference grows.
    pub trajectory: f64,
    pub passed: bool,
}

/// One array written by one stage, worst over all calls; or the balance of a quantity over so many steps.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub stage: &'static str,
    pub array: &'static str,
    /// Numbers: largest difference over the largest value. Integers: the fraction that differs.
    pub worst: f64,
    /// Numbers: root mean square of the difference over that of the values.
    pub rms: f64,
    pub tolerance: f64,
    pub calls: u64,
    pub passed: bool,
}

/// Passes of contact dynamics that are compared in a step.
const PASSES: u32 = 8;

/// Compare `steps` steps stage by stage, after the device has done `after` steps on its own; then see over `balance`
/// more steps of the device that nothing gets lost. Whatever engine `options` name, both are run.
///
/// # Errors
/// As [`Simulation::new`] on the GPU engine, and whatever stops a run.
pub fn check(assembly: &Assembly, options: Options, after: u64, steps: u64, balance: u64) -> Result<Report> {
    let precision = options.precision;
    let options = Options { engine: EngineChoice::Gpu, ..options };
    let mut simulation = Simulation::new(assembly.clone(), options)?;
    simulation.advance(after)?;
    let arrays = present(simulation.model(), ARRAYS);
    let mut state = simulation.read(&arrays)?.clone();
    let plans = Setup::new(assembly, &options)?.plans;
    // The device's parameters are rounded to its precision; the twin must be asked about the same ones.
    if precision == Precision::Single {
        state.params = state.params.rounded(state.model.dims(), &state.units);
    }
    let bodies = state.sizes.bodies;
    for array in [&FORCE, &TORQUE].into_iter().filter(|a| arrays.contains(a)) {
        state.column_mut(array).resize(bodies);
    }
    let device = simulation.engine().gpu().expect("a simulation on the device");
    let gpu = device.beside(&state)?;

    let (mut checker, mut contacts) = (Checker::new(gpu, state), 0);
    for step in 0..steps {
        // Steps of rigid grains are long: every one gets lists of its own.
        let rigid = checker.state.model.method == Method::ContactDynamics;
        checker.rebuild = step == 0 || checker.state.halt[0] >= HALTED || rigid;
        checker.state.params = params_of_step(&checker.state.params, simulation.step() + step);
        plans.sums.walk(&mut checker)?;
        plans.wall_loads.walk(&mut checker)?;
        contacts = contacts.max(Sample::new(0, 0.0, bodies, &checker.state.partial_sums).contacts);
        plans.forces.walk(&mut checker)?;
        plans.velocities.walk(&mut checker)?;
        plans.chunk.walk(&mut checker)?;
    }

    let Checker { mut rows, gpu, .. } = checker;
    let trajectory = trajectory(&mut simulation, assembly, options, steps)?;
    if balance > 0 {
        rows.extend(balances(&mut simulation, balance)?.into_iter().map(|b| Row {
            stage: "balance",
            array: b.of,
            worst: b.worst,
            rms: b.rms,
            tolerance: b.tolerance,
            calls: balance,
            passed: b.holds(),
        }));
    }
    let passed = rows.iter().all(|r| r.passed);
    let precision = precision.label();
    Ok(Report { adapter: gpu.adapter(), precision, steps, after, contacts, rows, trajectory, passed })
}

/// How far a simulation on the device is from one of the same scene on the CPU, after so many more steps: the grains that both
/// have, of those that come and go.
fn trajectory(on_gpu: &mut Simulation, assembly: &Assembly, options: Options, steps: u64) -> Result<f64> {
    on_gpu.advance(steps)?;
    let mut on_cpu = Simulation::new(assembly.clone(), Options { engine: EngineChoice::Cpu, ..options })?;
    on_cpu.advance(on_gpu.step())?;
    let [gpu, cpu] = [&mut *on_gpu, &mut on_cpu].map(|simulation| simulation.grains());
    let named = |simulation: &Simulation, grains: &[Grain]| -> BTreeMap<u32, DVec3> {
        let numbers = &simulation.assembly().numbers;
        grains.iter().enumerate().map(|(k, grain)| (numbers.of_grain(k), grain.position)).collect()
    };
    let (gpu, cpu) = (named(on_gpu, &gpu?), named(&on_cpu, &cpu?));
    let domain = on_gpu.domain()?;
    let both = gpu.iter().filter_map(|(number, x)| Some(*x - *cpu.get(number)?));
    let distance = both.map(|d| domain.nearest(d).length()).fold(0.0, f64::max);
    Ok(distance / assembly.whole().mean_radius())
}

/// Walks a plan on both engines.
struct Checker {
    gpu: Gpu,
    /// Of the twins; where both have written, that of the device.
    state: State,
    rows: Vec<Row>,
    /// Whether the next step gets new lists.
    rebuild: bool,
    coloring: Coloring,
}

impl Driver for Checker {
    fn run(&mut self, op: Op) -> Result<()> {
        if let Op::Run(stage) = op {
            return self.compare(stage);
        }
        self.gpu.execute(&self.state.params, &[op])?;
        apply(&op, &mut self.state);
        Ok(())
    }

    fn rounds(&mut self, of: Loop, done: u32) -> Result<u32> {
        match (of, done) {
            (Loop::UntilColored, 1..) => self.is_colored().map(|colored| u32::from(!colored)),
            (_, 1..) => Ok(0),
            (Loop::IfListsAreUsedUp | Loop::IfGrainsAreSorted, _) => Ok(u32::from(self.rebuild)),
            // What would be taken back is compared like all else, and the comparison goes on from there.
            (Loop::HaltedSteps | Loop::IfStepIsTakenBack, _) => Ok(0),
            (Loop::IfColorsDoNotFit, _) => Ok(u32::from(self.coloring.too_short)),
            (Loop::Times(n), _) => Ok(n.min(PASSES)),
            (Loop::Passes, _) => Ok(PASSES),
            (Loop::ForEachColor, _) => Ok(self.coloring.colors),
            _ => Ok(1),
        }
    }
}

impl Checker {
    fn new(gpu: Gpu, state: State) -> Checker {
        Checker { gpu, state, rows: Vec::new(), rebuild: false, coloring: Coloring::default() }
    }

    /// Run a stage on both, compare what they have written, and go on with what the device has.
    fn compare(&mut self, stage: &'static Stage) -> Result<()> {
        // A check that runs out of list entries would compare two refusals.
        let written = self.gpu.written(stage).to_vec();
        let (lists, history) = (self.state.list_start.last().copied(), self.state.history_start.last().copied());
        for (kind, needed) in [(Length::Entries, lists), (Length::History, history)] {
            if written.iter().any(|a| a.length == kind) {
                self.grow(kind, needed.unwrap_or(0) as usize)?;
            }
        }
        self.gpu.execute(&self.state.params, &[Op::Run(stage)])?;
        let undecided = undecided(&self.state, stage.check.undecided);
        let overlap = deepest(&self.state);
        (stage.twin)(&mut self.state);
        let mut device = self.state.clone();
        self.gpu.read(&written, ALL, &mut device)?;
        for &array in &written {
            let tolerance = self.tolerance(stage, array, overlap);
            let (worst, rms) = compare(&self.state, &device, stage, array, &undecided);
            self.record(stage, array, worst, rms, tolerance);
        }
        for array in written {
            let column = device.column(array);
            self.state.column_mut(array).replace(column.duplicate(0..column.len()));
        }
        Ok(())
    }

    /// Make arrays of a kind of length this long at least.
    fn grow(&mut self, kind: Length, needed: usize) -> Result<()> {
        let of_kind = ARRAYS.iter().filter(|a| a.length == kind);
        let mut short = present(&self.state.model, of_kind);
        short.retain(|array| needed > self.state.column(array).len());
        short.iter().for_each(|array| self.state.column_mut(array).resize(needed));
        self.gpu.resize(&short, needed)?;
        // Nobody says what is in them then, and kernels do not write all of it.
        self.gpu.read(&short, ALL, &mut self.state)
    }

    /// Whether all contacts have a colour.
    fn is_colored(&mut self) -> Result<bool> {
        let seen = self.state.coloring_state[0];
        let colored = self.coloring.look(&seen, &mut self.state.sizes)?;
        if self.coloring.too_short {
            for kind in [Length::Contacts, Length::Colors] {
                self.grow(kind, self.state.sizes.of(kind))?;
            }
        }
        Ok(colored)
    }

    /// Roundings of the largest term; integers are exact.
    fn tolerance(&self, stage: &Stage, array: &'static Array, overlap: f64) -> f64 {
        let precision = self.state.model.precision;
        let roundings = match stage.check.tolerance {
            Tolerance::Overlap if overlap > 0.0 && precision == Precision::Double => {
                return 16.0 * precision.epsilon() * (1.0 / overlap).max(1.0);
            }
            Tolerance::Cancellation(sums) if sums == array => Tolerance::CANCELLED_ROUNDINGS,
            _ => Tolerance::ROUNDINGS,
        };
        roundings * precision.epsilon()
    }

    fn record(&mut self, stage: &Stage, array: &'static Array, worst: f64, rms: f64, tolerance: f64) {
        let passed = worst <= tolerance;
        match self.rows.iter_mut().find(|r| r.stage == stage.name && r.array == array.name) {
            Some(row) => {
                // The call that came closest to its tolerance speaks for the row.
                if worst * row.tolerance >= row.worst * tolerance {
                    (row.worst, row.rms, row.tolerance) = (worst, rms, tolerance);
                }
                row.calls += 1;
                row.passed &= passed;
            }
            None => {
                self.rows.push(Row { stage: stage.name, array: array.name, worst, rms, tolerance, calls: 1, passed })
            }
        }
    }
}
