//! Grains faster than their radius per step.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;
use crate::{
    Error,
    measure::Sample,
    scene::{Assembly, Grain, TimeStep},
    simulation::Simulation,
};
use glam::DVec3;

/// What becomes of grain 0, which flies along +x at something.
struct Fate {
    /// It is behind what it flew at, and nobody said a word.
    tunnelled: bool,
    /// Relative gain of energy, if it was followed.
    gain: f64,
    /// The run was stopped, and the message names the grain.
    named: bool,
    refused: bool,
}

fn fate(bench: Bench, scene: &Assembly, behind: impl Fn(&[Grain]) -> bool, steps: u64) -> Fate {
    let total = |s: &Sample| s.kinetic_energy + s.elastic_energy + s.potential_energy;
    let mut outcome = Simulation::new(scene.clone(), bench.options());
    let before = outcome.as_mut().map_or(0.0, |s| total(&s.sample().unwrap()));
    let error = match &mut outcome {
        Ok(s) => s.advance(steps).err(),
        Err(e) => Some(Error::Scene(e.to_string())),
    };
    let named = error.as_ref().is_some_and(|e| e.to_string().contains("grain 0"));
    let refused = error.is_some();
    let Ok(simulation) = &mut outcome else { return Fate { tunnelled: false, gain: 0.0, named, refused } };
    // After an error the state is the last good one: that must not lie behind either.
    let tunnelled = behind(&simulation.grains().unwrap());
    let after = simulation.sample().unwrap();
    let gain = (total(&after) - before) / (after.kinetic_energy + after.elastic_energy);
    Fate { tunnelled, gain: if refused { 0.0 } else { gain }, named, refused }
}

/// Speeds in radii per step, with thin and thick margins; at a grain, a small grain, a free grain and a wall; and a
/// speed that gravity gives during the run.
pub fn fast_grain(bench: Bench, _: Length) -> Vec<Figure> {
    let given = scene("fast_grain");
    let TimeStep::Fixed(dt) = given.solver.dt else { panic!("a fixed step") };
    let (mut tunnelled, mut unnamed, mut followed_fast) = (0, 0, 0);
    let mut gain: f64 = 0.0;
    let mut count = |fate: Fate, radii: f64| {
        tunnelled += usize::from(fate.tunnelled);
        unnamed += usize::from(fate.refused && !fate.named);
        followed_fast += usize::from(radii > 1.0 && !fate.refused);
        if radii < 1.0 {
            gain = worse(gain, fate.gain);
        }
    };
    let target = given.grains[1];
    for margin in [0.2, 10.0] {
        for radii in [0.09, 0.4, 1.5, 4.9, 50.0] {
            for kind in 0..4 {
                let mut scene = given.clone();
                scene.solver.margin = margin;
                scene.grains[0].velocity = DVec3::X * radii * R / dt;
                match kind {
                    0 => {}
                    1 => scene.grains[1] = Grain { radius: 0.1 * R, ..target },
                    2 => scene.grains[1] = Grain { fixed: false, ..target },
                    _ => {
                        scene.walls = vec![plane(target.position, DVec3::NEG_X)];
                        scene.grains.truncate(1);
                    }
                }
                let behind = |g: &[Grain]| g[0].position.x > g.get(1).map_or(target.position.x, |g| g.position.x);
                count(fate(bench, &scene, behind, 200), radii);
            }
        }
        // From rest, 0.015 R per step faster in every step: it arrives at 0.6 R per step.
        for wall in [false, true] {
            let mut scene = given.clone();
            scene.solver.margin = margin;
            scene.gravity = DVec3::X * 0.015 * R / dt / dt;
            scene.grains[0].velocity = DVec3::ZERO;
            if wall {
                scene.walls = vec![plane(target.position, DVec3::NEG_X)];
                scene.grains.truncate(1);
            }
            let behind = |g: &[Grain]| g[0].position.x > target.position.x;
            count(fate(bench, &scene, behind, 200), 0.0);
        }
    }
    vec![
        Figure::zero("of 44: behind its target, silently", 0.0, tunnelled as f64),
        Figure::zero("of 44: refused without naming the grain", 0.0, unnamed as f64),
        Figure::zero("of 24 faster than R per step: followed all the same", 0.0, followed_fast as f64),
        // (ω Δt)²/4 of two equal ones; the step is long, so that energies stay below ½ k_N (2 R)², which no contact
        // stops.
        Figure::zero("energy gained by the followed", 0.2, gain),
    ]
}
