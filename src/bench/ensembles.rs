//! Settled beds. Their trajectories are chaotic, so means over seeds are compared, with how far seeds scatter.

use super::{
    log::{Log, Measure, no_reference},
    trial::{Backend, Cost, Setting, Trial, automatic_step, scene},
};
use crate::{
    Result,
    measure::packing_fraction,
    scene::{Assembly, Grain, Surface},
};
use std::f64::consts::PI;

const QUANTITIES: [(&str, &str); 3] = [("packing fraction", ""), ("coordination", ""), ("mean pressure", "Pa")];

pub fn run(log: &mut Log) {
    let (grains, side, time, seeds) = log.pick((300, 0.0115, 0.07, 3), (1000, 0.018, 0.12, 8));
    let factors: &[f64] = log.pick(&[4.0], &[1.0, 2.0, 4.0]);
    let smallest = log.pick(2.0, 0.5);
    let bed = |seed| {
        let sets = [
            format!("seed={seed}"),
            format!("population.0.count={grains}"),
            format!("domain.upper=[{side}, {side}, 1]"),
            format!("stop.time={time}"),
        ];
        scene("bed", include_str!("scenes/bed.toml"), &sets)
    };
    let measure = |setting| -> Result<(Cost, [Statistics; 3])> {
        let mut all = Vec::new();
        for seed in 1..=seeds {
            all.push(settle(bed(seed)?, setting)?);
        }
        let cost = all.iter().map(|(cost, _)| *cost).reduce(Cost::and).expect("there are seeds");
        Ok((cost, std::array::from_fn(|k| Statistics::of(all.iter().map(|(_, values)| values[k])))))
    };
    let mut reference = None;
    let finest = Setting { backend: Backend::Cpu, factor: smallest };
    let others = log.settings(factors);
    for setting in std::iter::once(finest).chain(others) {
        log.run("settled bed", setting, || {
            let (cost, found) = measure(setting)?;
            if setting == finest {
                reference = Some(found);
            }
            let expected = reference.ok_or_else(no_reference)?;
            let row = |k: usize| compared(QUANTITIES[k], found[k], (setting != finest).then_some(expected[k]));
            Ok((cost, (0..QUANTITIES.len()).map(row).collect()))
        });
    }
}

fn compared(of: (&'static str, &'static str), found: Statistics, expected: Option<Statistics>) -> Measure {
    let error = expected.map(|e| (found.mean - e.mean).abs());
    let standard_errors =
        expected.map(|e| (found.mean - e.mean).abs() / found.error_of_mean().hypot(e.error_of_mean()));
    let (value, spread) = (Some(found.mean), Some(found.deviation));
    Measure { quantity: of.0, unit: of.1, error, value, spread, standard_errors, ..Measure::default() }
}

/// Of one quantity over the seeds.
#[derive(Clone, Copy)]
struct Statistics {
    seeds: f64,
    mean: f64,
    /// Standard deviation of the seeds, with n - 1.
    deviation: f64,
}

impl Statistics {
    fn of(values: impl ExactSizeIterator<Item = f64> + Clone) -> Statistics {
        let seeds = values.len() as f64;
        let mean = values.clone().sum::<f64>() / seeds;
        let deviation = (values.map(|x| (x - mean).powi(2)).sum::<f64>() / (seeds - 1.0)).sqrt();
        Statistics { seeds, mean, deviation }
    }

    fn error_of_mean(&self) -> f64 {
        self.deviation / self.seeds.sqrt()
    }
}

/// The quantities of a bed after its `stop.time`.
fn settle(bed: Assembly, setting: Setting) -> Result<(Cost, [f64; 3])> {
    let time = bed.stop.time.expect("the bed has a time");
    let steps = (time / (setting.factor * automatic_step(&bed)?)).ceil() as u64;
    let mut trial = Trial::new(&bed, setting)?;
    trial.advance(steps)?;
    let coordination = trial.simulation.sample()?.coordination_number;
    let grains = trial.simulation.grains()?;
    let filled = packing_fraction(&bed, &grains, &bed.walls).map_or(f64::NAN, |f| f.value);
    Ok((trial.cost()?, [filled, coordination, pressure(&bed, &grains, filled)]))
}

/// A third of the trace of the stress, Σ l · f / 3 V, Pa, over all contacts: l is the branch vector, V the volume of
/// the grains over the packing fraction. Tangential forces are normal to l and have no part in it, so positions
/// suffice.
fn pressure(bed: &Assembly, grains: &[Grain], filled: f64) -> f64 {
    let stiffness = bed.pairs[0].normal_stiffness;
    let work = |overlap: f64, branch: f64| if overlap > 0.0 { stiffness * overlap * branch } else { 0.0 };
    let mut trace = 0.0;
    for (i, a) in grains.iter().enumerate() {
        for b in &grains[..i] {
            let distance = bed.domain.nearest(a.position - b.position).length();
            trace += work(a.radius + b.radius - distance, distance);
        }
        for surface in bed.walls.iter().map(|w| &w.surface).filter(|s| matches!(s, Surface::Plane { .. })) {
            let distance = surface.distance(a.position);
            trace += work(a.radius - distance, distance);
        }
    }
    let volume = grains.iter().map(|g| 4.0 / 3.0 * PI * g.radius.powi(3)).sum::<f64>() / filled;
    trace / (3.0 * volume)
}

#[cfg(test)]
mod tests {
    use super::Statistics;

    #[test]
    fn seeds_scatter_about_their_mean() {
        let s = Statistics::of([1.0, 2.0, 3.0, 4.0].into_iter());
        assert!((s.mean - 2.5).abs() < 1e-15 && (s.deviation - (5.0_f64 / 3.0).sqrt()).abs() < 1e-15);
        assert!((s.error_of_mean() - s.deviation / 2.0).abs() < 1e-15);
    }
}
