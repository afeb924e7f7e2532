//! Far from the origin, in wide domains, and slowly.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;
use crate::scene::{Assembly, Grain, Pair, Surface, TimeStep};
use glam::DVec3;

/// 1e4 diameters.
const FAR: f64 = 2e4 * R;

/// The scene with everything, walls too, moved.
fn moved(scene: &Assembly, by: DVec3) -> Assembly {
    let mut scene = scene.clone();
    scene.grains.iter_mut().for_each(|g| g.position += by);
    for wall in &mut scene.walls {
        match &mut wall.surface {
            Surface::Plane { point, .. } => *point += by,
            Surface::Cylinder { center, .. } => *center += by,
        }
    }
    scene
}

/// Accelerations at the start, from the velocities after one short step from rest.
fn accelerations(bench: Bench, scene: &Assembly) -> Vec<DVec3> {
    bench.after(scene, 1).iter().map(|g| g.velocity).collect()
}

/// Largest difference over the root mean square.
fn difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    let mean = (b.iter().map(|a| a.length_squared()).sum::<f64>() / b.len() as f64).sqrt();
    a.iter().zip(b).map(|(a, b)| (*a - *b).length() / mean).fold(0.0, worse)
}

/// A pressed block on a floor, 1e4 diameters away on every axis, with overlaps of 1e-3 R.
pub fn far_from_origin(bench: Bench, _: Length) -> Vec<Figure> {
    let there = scene("far_from_origin");
    let by = DVec3::new(20.0137, -14.0291, 6.0173);
    let here = moved(&there, -by);
    let near = accelerations(bench, &here);
    let free = |scene: &Assembly| Assembly { walls: vec![], ..scene.clone() };
    let grains_only = difference(&accelerations(bench, &free(&there)), &accelerations(bench, &free(&here)));
    vec![
        Figure::zero("forces between grains: there against here", 1e-5, grains_only),
        Figure::zero("with the floor: there against here", 1e-5, difference(&accelerations(bench, &there), &near)),
        Figure::zero("forces: against f64 here", 1e-5, difference(&near, &accelerations(CPU, &here))),
        Figure::zero("static overlap of a stack here", 1e-5, stack(bench, DVec3::ZERO)),
        Figure::zero("static overlap of a stack there", 1e-5, stack(bench, by)),
    ]
}

/// Worst relative error of the two overlaps of a stack of two, 1e-3 R and 2e-3 R.
fn stack(bench: Bench, at: DVec3) -> f64 {
    let kn = mass(3, R) * G / (1e-3 * R);
    let omega = (kn / mass(3, R)).sqrt();
    let mut scene = blank_dt(3, 0.2 / omega);
    scene.pairs = vec![Pair { normal_stiffness: kn, ..law(0.0) }];
    scene.gravity = DVec3::NEG_Z * G;
    scene.solver.damping = 0.6 * omega;
    scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
    scene.grains = vec![grain(0.0, 0.0, R), grain(0.0, 0.0, 3.0 * R)];
    let grains = bench.after(&moved(&scene, at), 700);
    let (lower, upper) = (grains[0].position.z - at.z, grains[1].position.z - at.z);
    let errors = [(R - lower) / (2e-3 * R) - 1.0, (2.0 * R - upper + lower) / (1e-3 * R) - 1.0];
    worse(errors[0].abs(), errors[1].abs())
}

/// Pairs in the middle, at the edge and across the seam of a periodic domain 1e4 diameters wide, against the same pairs
/// alone at the origin.
pub fn wide_domain(bench: Bench, _: Length) -> Vec<Figure> {
    let wide = scene("wide_domain");
    let found = accelerations(bench, &wide);
    let alone = |pair: &[Grain]| {
        let mut scene = blank_dt(3, 1e-7);
        scene.pairs = wide.pairs.clone();
        scene.grains = pair.to_vec();
        scene.grains[0].position = DVec3::ZERO;
        scene.grains[1].position = wide.domain.nearest(pair[1].position - pair[0].position);
        accelerations(bench, &scene)
    };
    ["middle", "edge", "across the seam", "across a corner"]
        .into_iter()
        .zip(wide.grains.chunks(2).zip(found.chunks(2)))
        .map(|(what, (pair, found))| Figure::zero(format!("forces: {what}"), 1e-5, difference(found, &alone(pair))))
        .collect()
}

/// 1e-7 diameters per step for 5,000 steps, 1e4 diameters from the origin.
pub fn slow_creep(bench: Bench, _: Length) -> Vec<Figure> {
    let steps = 5000;
    let path = |at: DVec3, dimension: usize| {
        let mut scene = blank_dt(dimension, 1e-5);
        let directions = [DVec3::X, DVec3::new(0.6, -0.8, 0.0), DVec3::new(-0.1, 0.99, 0.1)];
        scene.grains = directions
            .iter()
            .enumerate()
            .map(|(k, d)| {
                let velocity = 2e-7 * R / 1e-5 * DVec3::new(d.x, d.y, if dimension == 3 { d.z } else { 0.0 });
                let x = at + DVec3::X * 5.0 * R * k as f64;
                Grain { velocity, ..grain(x.x, x.y, x.z) }
            })
            .collect();
        scene.solver.dt = TimeStep::Fixed(1e-5);
        scene.solver.allow_unstable = true; // nothing touches
        let expected = |g: &Grain| g.velocity * 1e-5 * steps as f64;
        let after = bench.after(&scene, steps);
        let error = |(a, b): (&Grain, &Grain)| (a.position - b.position - expected(b)).length() / expected(b).length();
        after.iter().zip(&scene.grains).map(error).fold(0.0, worse)
    };
    // f64: 5,000 half ulps of 20 m over 1e-6 m. f32: what a step adds, 2e-10 m, to the low part's half ulp.
    let far = DVec3::new(FAR, -FAR, 0.3 * FAR);
    vec![
        Figure::zero("path at 1e4 diameters, relative error", bench.pick(1e-5, 1e-3), path(far, 3)),
        Figure::zero("the same in the plane", bench.pick(1e-5, 1e-3), path(far.with_z(0.0), 2)),
    ]
}
