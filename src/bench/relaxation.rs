//! Contact dynamics: how fast every solver brings the residual of one step down, on beds of rigid grains that come to
//! rest.

use super::{
    lattice,
    log::{Log, Measure, again},
    results::{RelaxationRow, ResidualRow},
    trial::{Backend, Cost, Setting, automatic_step, scene},
};
use crate::{
    error::{Error, Result},
    scene::{Assembly, Method, Relaxation, TimeStep},
    simulation::{ResidualRecord, Simulation},
    solve::{Order, Solver},
};
use glam::DVec3;

/// Residual at which a step is solved.
const TOLERANCE: f64 = 1e-4;
/// Residuals that are timed on the way there.
const MARKS: [f64; 3] = [1e-2, 1e-3, TOLERANCE];
/// A bed rests when its kinetic energy is this part of that of grains that have fallen for one step. This is asked
/// every so many steps, so often at most.
const REST: f64 = 1e-3;
const STEPS: u64 = 10;
const TIMES: u64 = 20;
/// The step that is timed, s: in a shorter one fewer pairs are only about to touch.
const DT: f64 = 2e-4;
/// Reach of the lists in the step that is timed, in mean radii: about what they have in a bed at rest.
const MARGIN: f64 = 0.1;
/// Points of a curve that are kept.
const KEPT: f64 = 150.0;

pub fn run(log: &mut Log) {
    let accelerator = log.machine.adapter.as_ref().is_some_and(|a| a.kind != "Cpu");
    let full = if accelerator { &[100, 1000, 10_000, 100_000, 1_000_000][..] } else { &[100, 1000, 10_000, 100_000] };
    let sizes = log.pick(&[100, 1000][..], full);
    for (k, size) in sizes.iter().enumerate() {
        if log.interrupted {
            return;
        }
        let (case, bed) = (format!("rigid bed {size}"), settled(*size));
        let seconds = log.pick(1.0, if *size < 100_000 { 20.0 } else { 40.0 });
        for contender in contenders(log, k == 0) {
            let Contender { backend, .. } = contender;
            let factor = bed.as_ref().map_or(1.0, |(_, factor)| *factor);
            let mut run = None;
            log.run(&format!("{case}, {}", contender.name()), Setting { backend, factor }, || {
                let (bed, _) = bed.as_ref().map_err(again)?;
                let (found, cost) = contender.solve(bed, seconds)?;
                let residual = run.insert(found).end.residual;
                Ok((cost, vec![Measure::error("residual", "", residual)]))
            });
            if let Some(run) = run {
                log.residuals.extend(run.curve(&case, &contender));
                log.relaxation.push(run.row(&case, &contender));
            }
        }
    }
}

/// A bed of about so many grains that has come to rest, to be released without velocities and impulses; and its step
/// over the automatic one.
fn settled(size: usize) -> Result<(Assembly, f64)> {
    let mut bed = lattice::pile(&scene("rigid bed", include_str!("scenes/rigid.toml"), &[])?, size);
    let mut simulation = Simulation::new(bed.clone(), Backend::Cpu.options())?;
    for _ in 0..TIMES {
        simulation.advance(STEPS)?;
        let sample = simulation.sample()?;
        if sample.kinetic_energy <= REST * sample.step_energy {
            break;
        }
    }
    bed.grains = simulation.grains()?;
    bed.grains.iter_mut().for_each(|grain| (grain.velocity, grain.spin) = (DVec3::ZERO, DVec3::ZERO));
    let factor = DT / automatic_step(&bed)?;
    bed.solver = crate::scene::Solver {
        dt: TimeStep::Fixed(DT),
        damping: 0.0,
        adaptive_damping: false,
        margin: MARGIN,
        allow_overlap: true,
        ..bed.solver
    };
    Ok((bed, factor))
}

/// A solver on an engine.
struct Contender {
    solver: Solver,
    order: Order,
    backend: Backend,
}

fn contenders(log: &Log, smallest: bool) -> Vec<Contender> {
    let of = |solver, backend| Contender { solver, order: Order::Fixed, backend };
    let sweeps = Order::ALL.map(|order| Contender { order, ..of(Solver::GaussSeidel, Backend::Cpu) });
    let mut all = Vec::from(sweeps);
    for solver in [Solver::Jacobi, Solver::JacobiAccelerated, Solver::ColouredAccelerated] {
        let backends = log.machine.backends().into_iter().filter(|b| *b != Backend::GpuDouble);
        all.extend(backends.map(|backend| of(solver, backend)));
    }
    if smallest {
        all.push(of(Solver::Socp, Backend::Cpu));
    }
    all
}

/// The relaxation of a step.
struct Run {
    grains: usize,
    /// That carry an impulse.
    contacts: u64,
    history: Vec<ResidualRecord>,
    end: ResidualRecord,
}

impl Contender {
    fn name(&self) -> String {
        match self.solver {
            Solver::GaussSeidel => format!("{} {}", self.solver.label(), self.order.label()),
            solver => solver.label().to_owned(),
        }
    }

    /// One step of the bed, within about so many seconds.
    fn solve(&self, bed: &Assembly, seconds: f64) -> Result<(Run, Cost)> {
        let mut bed = bed.clone();
        // How long an iteration takes: found by a run so short, in which drivers compile kernels before the first look.
        let few = if self.solver == Solver::Socp { 1 } else { 32 };
        bed.solver.method = Method::ContactDynamics(Relaxation {
            solver: self.solver,
            order: self.order,
            tolerance: TOLERANCE,
            max_iterations: few,
            // Overlaps that settling has left stay.
            max_correction_velocity: Some(0.0),
            compliant: false,
            gyroscopic: false,
        });
        let mut simulation = Simulation::new(bed, self.backend.options())?;
        let end = step(&mut simulation)?;
        let iteration = (end.seconds - simulation.residual_history()[0].seconds) / f64::from(few);
        simulation.rewind()?;
        simulation.limit_passes((seconds / iteration).max(f64::from(few)) as u32);
        let end = step(&mut simulation)?;
        let grains = simulation.assembly().grains.len();
        let cost = Cost {
            grains,
            steps: 1,
            seconds: end.seconds,
            dt: simulation.dt(),
            dt_bound: simulation.dt_bound(),
            bytes_per_particle: simulation.bytes_per_particle()?,
            bytes_per_step: None,
        };
        let history = simulation.residual_history().to_vec();
        Ok((Run { grains, contacts: simulation.sample()?.contacts, history, end }, cost))
    }
}

/// A step, and what its relaxation ended with.
fn step(simulation: &mut Simulation) -> Result<ResidualRecord> {
    simulation.advance(1)?;
    let end = simulation.residual_history().last().copied().filter(|end| end.residual.is_finite());
    end.ok_or_else(|| Error::Device("the residual is not a number".to_owned()))
}

impl Run {
    fn row(&self, case: &str, contender: &Contender) -> RelaxationRow {
        let to = MARKS.map(|mark| self.history.iter().find(|record| record.residual <= mark));
        let (passes, seconds) = (to.map(|l| l.map(|l| l.passes)), to.map(|l| l.map(|l| l.seconds)));
        let ResidualRecord { passes: all, residual, seconds: total } = self.end;
        RelaxationRow {
            case: case.to_owned(),
            solver: contender.name(),
            engine: contender.backend.engine(),
            precision: contender.backend.precision().label(),
            grains: self.grains,
            contacts: self.contacts,
            passes: all,
            seconds: total,
            residual,
            contact_passes_per_second: self.contacts as f64 * f64::from(all) / total,
            passes_to_1e2: passes[0],
            seconds_to_1e2: seconds[0],
            passes_to_1e3: passes[1],
            seconds_to_1e3: seconds[1],
            passes_to_1e4: passes[2],
            seconds_to_1e4: seconds[2],
        }
    }

    /// The history, thinned out to about evenly spaced ones on a logarithmic axis.
    fn curve(&self, case: &str, contender: &Contender) -> Vec<ResidualRow> {
        let ratio = f64::from(self.end.passes.max(2)).powf(1.0 / KEPT);
        let mut next = 0.0;
        let kept = self.history.iter().enumerate().filter(|(k, record)| {
            let keep = f64::from(record.passes) >= next || k + 1 == self.history.len();
            if keep {
                next = f64::from(record.passes) * ratio;
            }
            keep
        });
        let row = |record: &ResidualRecord| ResidualRow {
            case: case.to_owned(),
            solver: contender.name(),
            engine: contender.backend.engine(),
            precision: contender.backend.precision().label(),
            passes: record.passes,
            seconds: record.seconds,
            residual: record.residual,
        };
        kept.map(|(_, record)| row(record)).collect()
    }
}
