//! What grains of wide sizes cost: time and memory of a particle-step, over those of as many equal grains.

use super::{
    log::{Log, Measure, again},
    speed::{Budget, timed},
    trial::{Backend, scene},
};
use crate::{Result, scene::Assembly};
use std::f64::consts::PI;

/// The part of a box that is solid.
const SOLID: f64 = 0.3;

/// Spheres in a box: their radii, as scene files have them, the mean of the radii's cubes, mm³, and how fast they are,
/// m/s, so that lists live about as long whatever the time step is.
const BOXES: [(&str, &str, f64, f64); 3] = [
    ("equal", "1e-3", 1.0, 0.1),
    ("1:5", "{ uniform = [0.3333e-3, 1.6667e-3] }", 1.44, 0.5),
    // d90/d10 = 6
    ("log-normal", "{ log_normal = { mean = 1e-3, std = 0.794e-3, min = 0.1e-3, max = 6e-3 } }", 4.2, 3.0),
];

/// Scenes with few large grains, which the comparison does without.
const FEW_LARGE: [(&str, &str); 2] =
    [("ratio 20", include_str!("scenes/ratio_20.toml")), ("boulder", include_str!("scenes/boulder.toml"))];

/// A case: wide sizes, and what they are compared with.
type Case = (&'static str, Result<Assembly>, Result<Assembly>);

pub fn run(log: &mut Log) {
    let count = log.pick(1000, 20_000);
    let budget = log.pick(Budget { work: 1e5, least: 50, repeats: 1 }, Budget { work: 4e6, least: 200, repeats: 5 });
    let boxes = BOXES[1..].iter().map(|wide| (wide.0, filled(wide, count), filled(&BOXES[0], count)));
    let few_large = FEW_LARGE.iter().map(|(name, text)| {
        let wide = scene(name, text, &[]);
        let equal = wide.as_ref().map(without_large).map_err(again);
        (*name, wide, equal)
    });
    let cases: Vec<Case> = boxes.chain(few_large).collect();
    let settings = log.settings(&[1.0]).into_iter().filter(|s| s.backend != Backend::GpuDouble);
    for setting in settings.collect::<Vec<_>>() {
        for (name, wide, equal) in &cases {
            let mut reference = None;
            log.run(&format!("{name}, as equal grains"), setting, || {
                let (.., cost) = timed(equal.as_ref().map_err(again)?, setting, budget)?;
                reference = Some(cost);
                Ok((cost, [TIME, MEMORY].map(|quantity| Measure::reference(quantity, "of equal grains")).to_vec()))
            });
            let mut profile = None;
            log.run(name, setting, || {
                let (mut simulation, _, cost) = timed(wide.as_ref().map_err(again)?, setting, budget)?;
                profile = Some(simulation.profile(cost.steps)?);
                let equal = reference.ok_or_else(super::log::no_reference)?;
                let memory = cost.bytes_per_particle / equal.bytes_per_particle;
                let ratios = [(TIME, equal.rate() / cost.rate()), (MEMORY, memory)];
                Ok((cost, ratios.map(|(quantity, ratio)| Measure::error(quantity, "of equal grains", ratio)).to_vec()))
            });
            if let Some(profile) = profile {
                log.stages(name, setting, &profile);
            }
        }
    }
}

const TIME: &str = "time per particle-step";
const MEMORY: &str = "bytes per particle";

fn filled(&(name, radius, mean_cube, speed): &(&str, &str, f64, f64), count: usize) -> Result<Assembly> {
    let edge = 1e-3 * (4.0 / 3.0 * PI * mean_cube * count as f64 / SOLID).cbrt();
    let sets = [
        format!("population.0.count={count}"),
        format!("population.0.radius={radius}"),
        format!("population.0.velocity_spread={speed}"),
        format!("domain.upper=[{edge}, {edge}, {edge}]"),
    ];
    scene(name, include_str!("scenes/sizes.toml"), &sets)
}

fn without_large(wide: &Assembly) -> Assembly {
    let smallest = wide.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    let mut equal = wide.clone();
    equal.grains.retain(|g| g.radius == smallest);
    equal
}
