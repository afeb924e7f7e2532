//! Force and moment on the same state: the rounding of one evaluation, without the drift of a trajectory.

use super::{
    log::{Log, Measure, again},
    trial::{Backend, Cost, Setting, Trial, largest, rms, scene},
};
use crate::{Result, scene::Assembly};
use glam::DVec3;

/// Steps after which forces are compared, enough for tangential springs to exist and too few for states to part.
const STEPS: u64 = 10;

pub fn run(log: &mut Log) {
    let (grains, side, warm) = log.pick((1000, 0.0225, 1500), (8000, 0.045, 4000));
    let sets = [
        format!("population.0.count={grains}"),
        format!("domain.upper=[{side}, {side}, 1]"),
        // Without a dashpot the force has no jump where a contact opens, which rounding could put a step early or late.
        "material.glass.restitution=1".to_owned(),
    ];
    let start = scene("bed", include_str!("scenes/bed.toml"), &sets).and_then(|bed| settling(&bed, warm));
    let reference = start.as_ref().ok().map(|start| forces(start, Backend::Cpu));
    for setting in log.settings(&[1.0]) {
        log.run("settling bed", setting, || {
            let start = start.as_ref().map_err(again)?;
            let (expected, cost) = reference.as_ref().expect("there is a start").as_ref().map_err(again)?;
            if setting.backend == Backend::Cpu {
                return Ok((*cost, QUANTITIES.map(|quantity| Measure::reference(quantity, "")).to_vec()));
            }
            let (found, cost) = forces(start, setting.backend)?;
            let force = errors(expected.iter().zip(&found).map(|(e, f)| (e.0, f.0)));
            let moment = errors(expected.iter().zip(&found).map(|(e, f)| (e.1, f.1)));
            let all = [force.0, force.1, moment.0, moment.1];
            Ok((cost, QUANTITIES.iter().zip(all).map(|(quantity, e)| Measure::error(quantity, "", e)).collect()))
        });
    }
}

const QUANTITIES: [&str; 4] = ["force rms", "force worst", "moment rms", "moment worst"];

/// The scene as it is after some steps, in numbers that f32 holds, so that all engines begin with the same ones.
fn settling(bed: &Assembly, steps: u64) -> Result<Assembly> {
    let mut trial = Trial::new(bed, Setting { backend: Backend::Cpu, factor: 1.0 })?;
    trial.advance(steps)?;
    let mut now = bed.clone();
    now.grains = trial.simulation.grains()?;
    now.solver.allow_overlap = true;
    for grain in &mut now.grains {
        for vector in [&mut grain.position, &mut grain.velocity, &mut grain.spin] {
            *vector = vector.as_vec3().as_dvec3();
        }
        grain.radius = f64::from(grain.radius as f32);
    }
    Ok(now)
}

fn forces(start: &Assembly, backend: Backend) -> Result<(Vec<(DVec3, DVec3)>, Cost)> {
    let mut trial = Trial::new(start, Setting { backend, factor: 1.0 })?;
    trial.advance(STEPS)?;
    Ok((trial.simulation.forces()?, trial.cost()?))
}

/// RMS and worst length of the difference, over the RMS length of what is expected.
fn errors(pairs: impl ExactSizeIterator<Item = (DVec3, DVec3)> + Clone) -> (f64, f64) {
    let scale = rms(pairs.clone().map(|(e, _)| e.length_squared()));
    let difference = pairs.map(|(e, f)| (e - f).length());
    (rms(difference.clone().map(|d| d * d)) / scale, largest(difference) / scale)
}
