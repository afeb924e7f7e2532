//! Particle-steps per second against the number of grains, on dense packings; beside it how far the engines part, and
//! where the time goes, stage by stage.

use super::{
    lattice,
    log::{Log, Measure, again},
    trial::{Backend, Cost, Setting, Trial, displacement, scene},
};
use crate::{
    Result,
    scene::{Assembly, Grain},
    simulation::Simulation,
};

/// Steps before the clock runs, after which engines are compared.
const WARM: u64 = 20;
/// Steps that take in lists being made as often as they are in a long run: about as many as lists serve.
const LIFE: u64 = 50;

pub fn run(log: &mut Log) {
    let sizes: &[usize] = log.pick(&[1000, 10_000], &[1000, 10_000, 100_000, 1_000_000]);
    let budget = log.pick(Budget { work: 3e5, least: LIFE, repeats: 3 }, Budget { work: 3e6, least: LIFE, repeats: 5 });
    let spheres = || scene("spheres", include_str!("scenes/spheres.toml"), &[]);
    let disks = || scene("disks", include_str!("scenes/disks.toml"), &[]);
    let scenes: [(&str, Result<Assembly>, Lattice); 3] =
        [("spheres", spheres(), lattice::fill), ("rods", spheres(), lattice::rods), ("disks", disks(), lattice::fill)];
    for (name, start, lattice) in &scenes {
        for size in sizes {
            let filled = start.as_ref().map(|start| lattice(start, *size));
            let mut reference: Option<Vec<Grain>> = None;
            let settings = log.settings(&[1.0]).into_iter().filter(|s| s.backend != Backend::GpuDouble);
            for setting in settings {
                let case = format!("{name} {size}");
                let mut profile = None;
                log.run(&case, setting, || {
                    let filled = filled.as_ref().map_err(|e| again(e))?;
                    let (mut simulation, grains, mut cost) = timed(filled, setting, budget)?;
                    let found = profile.insert(simulation.profile(cost.steps)?);
                    cost.bytes_per_step = Some(found.bytes_per_particle_step());
                    let Some(expected) = &reference else {
                        reference = Some(grains);
                        return Ok((cost, vec![Measure::reference("displacement", "mean radii")]));
                    };
                    let error = displacement(filled, &grains, expected);
                    Ok((cost, vec![Measure::error("displacement", "mean radii", error)]))
                });
                if let Some(profile) = profile {
                    log.stages(&case, setting, &profile);
                }
            }
        }
    }
}

/// What fills the domain with about so many grains.
type Lattice = fn(&Assembly, usize) -> Assembly;

/// How long to measure.
#[derive(Clone, Copy)]
pub struct Budget {
    /// Particle-steps of one measurement,
    pub work: f64,
    /// but at least so many steps.
    pub least: u64,
    /// The median of so many measurements; of three at least, if these few steps are more work.
    pub repeats: usize,
}

/// The grains after the warm steps, what a step costs after that, and the simulation to go on with.
pub fn timed(start: &Assembly, setting: Setting, budget: Budget) -> Result<(Simulation, Vec<Grain>, Cost)> {
    let mut trial = Trial::new(start, setting)?;
    trial.advance(WARM)?;
    let grains = trial.simulation.grains()?;
    let affordable = budget.work / grains.len() as f64;
    let steps = affordable.clamp(budget.least as f64, 2000.0) as u64;
    let repeats = (budget.repeats as f64 * affordable / steps as f64)
        .clamp(budget.repeats.min(3) as f64, budget.repeats as f64) as usize;
    let mut costs = Vec::new();
    for _ in 0..repeats {
        let before = trial.cost()?;
        trial.advance(steps)?;
        let after = trial.cost()?;
        costs.push(Cost { steps, seconds: after.seconds - before.seconds, ..after });
    }
    costs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    Ok((trial.simulation, grains, costs[costs.len() / 2]))
}
