//! What must not change: energy and momenta of elastic gases; of rough, inelastic grains, the energy that they have and
//! that friction and damping have taken together.

use super::{
    log::{Log, Measure},
    trial::{Cost, Setting, Trial, largest, scene},
};
use crate::{
    Result,
    check::balance::{BALANCED_STEPS, balances},
    measure::{Sample, angular_momentum, masses, momentum},
    scene::{Assembly, Dashpot, Grain},
};
use glam::DVec3;

/// Looks at a run; the first is at time 0.
const SAMPLES: u64 = 20;

pub fn run(log: &mut Log) {
    let factors: &[f64] = log.pick(&[1.0], &[0.5, 1.0, 2.0]);
    let steps = log.pick(1000, 20_000);
    for setting in log.settings(factors) {
        log.run("smooth gas", setting, || {
            gas(scene("gas", include_str!("scenes/gas.toml"), &[])?, setting, steps, linear)
        });
    }
    for setting in log.settings(factors) {
        log.run("rough drum", setting, || {
            gas(scene("drum", include_str!("scenes/drum.toml"), &[])?, setting, steps, angular)
        });
    }
    let steps = log.pick(400, 4000);
    for setting in log.settings(factors) {
        log.run("rough rain", setting, || {
            rain(
                scene("rough", include_str!("scenes/rough.toml"), &[])?,
                setting,
                (steps as f64 / setting.factor) as u64,
            )
        });
    }
}

/// A momentum that the scene keeps, and what it is measured by.
struct Momentum {
    quantity: &'static str,
    value: DVec3,
    scale: f64,
}

/// Against the sum of the grains' momenta.
fn linear(_: &Assembly, grains: &[Grain], masses: &[f64]) -> Momentum {
    let scale = grains.iter().zip(masses).map(|(g, m)| m * g.velocity.length()).sum();
    Momentum { quantity: "momentum drift", value: momentum(grains, masses), scale }
}

/// About the origin, against the sum of the grains' greatest moments.
fn angular(assembly: &Assembly, grains: &[Grain], masses: &[f64]) -> Momentum {
    let scale = grains.iter().zip(masses).map(|(g, m)| m * g.position.length() * g.velocity.length()).sum();
    let value = angular_momentum(assembly, grains, masses).expect("the drum is not periodic");
    Momentum { quantity: "angular momentum drift", value, scale }
}

fn gas(
    start: Assembly,
    setting: Setting,
    steps: u64,
    kept: fn(&Assembly, &[Grain], &[f64]) -> Momentum,
) -> Result<(Cost, Vec<Measure>)> {
    let masses = masses(&start);
    let mut trial = Trial::new(&start, setting)?;
    let mut energies = vec![balance(&trial.simulation.sample()?)];
    let before = kept(&start, &trial.simulation.grains()?, &masses);
    for _ in 0..SAMPLES {
        trial.advance(steps / SAMPLES)?;
        energies.push(balance(&trial.simulation.sample()?));
    }
    let after = kept(&start, &trial.simulation.grains()?, &masses);
    let cost = trial.cost()?;
    let per_1e5 = 1e5 / cost.steps as f64;
    let first = energies[0];
    let drift = (after.value - before.value).length() / before.scale * per_1e5;
    let mut measures = vec![Measure::error(before.quantity, "per 1e5 steps", drift)];
    if conserves(&start) {
        let deviation = largest(energies.iter().map(|e| (e - first).abs())) / first;
        let trend = slope(&energies).abs() * SAMPLES as f64 / first;
        measures.push(Measure::error("energy", "", deviation));
        measures.push(Measure::error("energy drift", "per 1e5 steps", trend * per_1e5));
    }
    measures.extend(lost(&mut trial)?);
    Ok((cost, measures))
}

/// What rounding takes the same way in every step, of what comes and goes: it shows in no energy of a whole scene.
fn lost(trial: &mut Trial) -> Result<Vec<Measure>> {
    let found = balances(&mut trial.simulation, BALANCED_STEPS)?;
    // The energy of rough grains depends on the length of the step first of all.
    Ok(found.into_iter().filter(|b| b.of != "energy").map(|b| Measure::error(b.of, "lost", b.worst)).collect())
}

/// Grains that lose energy. Every step is looked at, because forces jump where contacts close and open.
fn rain(start: Assembly, setting: Setting, steps: u64) -> Result<(Cost, Vec<Measure>)> {
    let mut trial = Trial::new(&start, setting)?;
    let dt = trial.simulation.dt();
    let first = balance(&trial.simulation.sample()?);
    let (mut taken, mut deviations) = (0.0, Vec::new());
    for _ in 0..steps {
        trial.advance(1)?;
        let sample = trial.simulation.sample()?;
        taken += dt * sample.dissipation;
        deviations.push((balance(&sample) + taken - first).abs());
    }
    let error = largest(deviations.into_iter()) / taken;
    let cost = trial.cost()?;
    let lost = lost(&mut trial)?;
    Ok((cost, [vec![Measure::error("energy balance", "", error)], lost].concat()))
}

/// All energy that the grains have, J.
fn balance(sample: &Sample) -> f64 {
    sample.kinetic_energy + sample.potential_energy + sample.elastic_energy
}

/// Whether that stays as it is. Rough grains lose some where they slide and where contacts open, which few looks miss.
fn conserves(scene: &Assembly) -> bool {
    scene.pairs.iter().all(|pair| pair.friction == 0.0 && pair.dashpot == Dashpot::None)
}

/// Slope of the least-squares line through equidistant values, per interval.
fn slope(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = values.iter().sum::<f64>() / n;
    let (mut above, mut below) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate() {
        let x = k as f64 - middle;
        above += x * (value - mean);
        below += x * x;
    }
    above / below
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_line_has_its_slope() {
        assert!((super::slope(&[1.0, 3.0, 5.0, 7.0]) - 2.0).abs() < 1e-15);
    }
}
