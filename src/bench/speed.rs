//! Particle-steps per second against the number of grains, on dense packings; beside it how far the engines part.

use super::{
    Log, Measure, lattice,
    trial::{Backend, Cost, Setting, Trial, displacement, scene},
};
use crate::{
    Result,
    scene::{Assembly, Grain},
};

/// Steps before the clock runs, after which engines are compared.
const WARM: u64 = 20;

pub fn run(log: &mut Log) {
    let sizes: &[usize] = log.pick(&[1000, 10_000], &[1000, 10_000, 100_000, 1_000_000]);
    let budget = log.pick(Budget { work: 3e5, repeats: 3 }, Budget { work: 3e6, repeats: 5 });
    let scenes = [
        ("spheres", scene("spheres", include_str!("scenes/spheres.toml"), &[])),
        ("disks", scene("disks", include_str!("scenes/disks.toml"), &[])),
    ];
    for (name, start) in &scenes {
        for size in sizes {
            let filled = start.as_ref().map(|start| lattice::fill(start, *size));
            let mut reference: Option<Vec<Grain>> = None;
            let settings = log.settings(&[1.0]).into_iter().filter(|s| s.backend != Backend::GpuDouble);
            for setting in settings {
                log.run(&format!("{name} {size}"), setting, || {
                    let (grains, cost) = timed(filled.as_ref().map_err(|e| super::again(e))?, setting, budget)?;
                    let Some(expected) = &reference else {
                        reference = Some(grains);
                        return Ok((cost, vec![Measure::reference("displacement", "mean radii")]));
                    };
                    let error = displacement(filled.as_ref().map_err(|e| super::again(e))?, &grains, expected);
                    Ok((cost, vec![Measure::error("displacement", "mean radii", error)]))
                });
            }
        }
    }
}

/// How long to measure.
#[derive(Clone, Copy)]
pub struct Budget {
    /// Particle-steps of one measurement.
    pub work: f64,
    /// The median of so many counts.
    pub repeats: usize,
}

/// The grains after the warm steps, and what a step costs after that.
pub fn timed(start: &Assembly, setting: Setting, budget: Budget) -> Result<(Vec<Grain>, Cost)> {
    let mut trial = Trial::new(start, setting)?;
    trial.advance(WARM)?;
    let grains = trial.simulation.grains()?;
    let steps = (budget.work / grains.len() as f64).clamp(10.0, 2000.0) as u64;
    let mut costs = Vec::new();
    for _ in 0..budget.repeats {
        let before = trial.cost()?;
        trial.advance(steps)?;
        let after = trial.cost()?;
        costs.push(Cost { steps, seconds: after.seconds - before.seconds, ..after });
    }
    costs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    Ok((grains, costs[costs.len() / 2]))
}
