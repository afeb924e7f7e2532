//! Contacts that are stiff, deep, spun or grazed.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;
use crate::scene::{Assembly, Grain, TimeStep, Wall};
use glam::DVec3;
use std::f64::consts::PI;

/// Overlaps of 1e-6 R: two grains rest on each other on a floor, and bounce off floor and each other.
pub fn stiff_contacts(bench: Bench, _: Length) -> Vec<Figure> {
    let stack = scene("stiff_contacts");
    let weight = mass(3, R) * G;
    let overlap = weight / stack.pairs[0].normal_stiffness;
    let grains = bench.after(&stack, 2000);
    let (lower, upper) = (grains[0].position.z, grains[1].position.z);
    let errors = [(R - lower) / (2.0 * overlap) - 1.0, (2.0 * R - upper + lower) / overlap - 1.0];
    let mut figures = vec![
        Figure::new("overlap over R", 1e-6, 1e-8, overlap / R),
        // f64: an ulp of 3 mm over 1e-9 m.
        Figure::zero("static force, relative error", bench.pick(1e-8, 1e-5), errors[0].abs().max(errors[1].abs())),
    ];
    for pair in [false, true] {
        let (depth, e) = bounce(bench, pair);
        let what = if pair { "pair" } else { "wall" };
        // (ω Δt)² at tc/100.
        figures.push(Figure::new(format!("impact on {what}: depth ω/v"), 1.0, 1e-3, depth));
        figures.push(Figure::new(format!("impact on {what}: restitution"), 1.0, 1e-3, e));
    }
    figures
}

/// Depth in v/ω and restitution of an impact that goes 1e-6 R deep.
fn bounce(bench: Bench, pair: bool) -> (f64, f64) {
    let reduced = if pair { 0.5 * mass(3, R) } else { mass(3, R) };
    let omega = (KN / reduced).sqrt();
    let (v, dt) = (1e-6 * R * omega, PI / omega / 100.0);
    let mut scene = blank_dt(3, dt);
    let gap = 3.3 * v * dt;
    if pair {
        scene.grains = vec![grain(-2.0 * R, 0.0, 0.0)];
    } else {
        scene.walls = vec![plane(DVec3::X * -R, DVec3::X)];
    }
    scene.grains.push(Grain { velocity: DVec3::NEG_X * v, ..grain(gap, 0.0, 0.0) });
    let mut simulation = bench.start(&scene);
    let mut depth: f64 = 0.0;
    for _ in 0..115 {
        simulation.advance(1).unwrap();
        let grains = simulation.grains().unwrap();
        let other = if pair { grains[0].position.x + 2.0 * R } else { 0.0 };
        depth = depth.max(other - grains[grains.len() - 1].position.x);
    }
    let grains = simulation.grains().unwrap();
    let other = if pair { grains[0].velocity.x } else { 0.0 };
    (depth * omega / v, (grains[grains.len() - 1].velocity.x - other) / v)
}

/// A pair that overlaps by 20 %, a coincident pair, a coincident trio.
pub fn initial_overlap(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("overlap");
    let stored: f64 = [0.2 * R, 2.0 * R, 2.0 * R, 2.0 * R, 2.0 * R].iter().map(|s| 0.5 * KN * s * s).sum();
    let mut simulation = bench.start(&scene);
    let before = simulation.sample().unwrap();
    simulation.advance(300).unwrap();
    let after = simulation.sample().unwrap();
    let grains = simulation.grains().unwrap();
    let numbers = grains.iter().flat_map(|g| [g.position, g.velocity, g.spin]);
    let dissipation = [before.dissipation, after.dissipation];
    let broken = numbers.filter(|v| !v.is_finite()).count() + dissipation.iter().filter(|p| !p.is_finite()).count();
    let groups = [&grains[0..2], &grains[2..4], &grains[4..7]];
    let lopsided = groups.iter().map(|g| {
        let total: DVec3 = g.iter().map(|g| g.velocity).sum();
        total.length() / g.iter().map(|g| g.velocity.length()).fold(0.0, f64::max)
    });
    vec![
        Figure::zero("not a number", 0.0, broken as f64),
        Figure::new("contacts at the end", 0.0, 0.0, after.contacts as f64),
        Figure::new("elastic energy in, over ½ k_N δ²", 1.0, bench.pick(1e-12, 1e-6), before.elastic_energy / stored),
        // (ω Δt)² at tc/72.
        Figure::new("kinetic energy out, over elastic energy in", 1.0, 2e-3, after.kinetic_energy / stored),
        // Opposite forces: rounding of 300 additions.
        Figure::zero("momentum of a group", bench.pick(1e-14, 1e-6), lopsided.fold(0.0, worse)),
    ]
}

/// 1e5 rad/s: in free flight, on a floor where it slips all the time, and on a partner that spins the other way.
pub fn fast_spin(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("spin");
    let (mu, vn) = (scene.pairs[0].friction, scene.grains[0].velocity.z.abs());
    let grains = bench.after(&scene, 120);
    let given = |k: usize| scene.grains[k];
    let change = grains[0].spin.y - given(0).spin.y;
    let aside = grains[2..4].iter().map(|g| g.velocity.y.abs() / vn).fold(0.0, worse);
    let turned = (1..4).map(|k| (grains[k].spin - given(k).spin).length() / 1e5).fold(0.0, worse);
    vec![
        // Arms shorter by half of an overlap of up to 3e-3 R.
        Figure::new("floor: R Δω / μ v_n", -5.0, 8e-3, R * change / mu / vn),
        Figure::new("floor: Δv_t / μ v_n", 2.0, 2e-3, grains[0].velocity.x / mu / vn),
        Figure::new("floor: v_n out over in", 1.0, 1e-3, grains[0].velocity.z / vn),
        Figure::zero("free or counter-spinning: change of spin", 0.0, turned),
        Figure::zero("counter-spinning pair: sideways over v_n", bench.pick(1e-15, 1e-7), aside),
    ]
}

/// On a floor and into a corner of two walls, at slopes from 1e-1 to 1e-4 and 8 phases of the touch between steps: the
/// energy gained is that of the normal motion times what leapfrog gains at first touch.
pub fn grazing_impact(bench: Bench, _: Length) -> Vec<Figure> {
    let given = scene("corner");
    let mut figures = Vec::new();
    for (what, walls) in [("floor", 1), ("corner", 2)] {
        for friction in [0.0, 0.5] {
            let mut scene = given.clone();
            scene.walls.truncate(walls);
            scene.pairs[0].friction = friction;
            scene.pairs[0].tangential_stiffness = 2.0 / 7.0 * scene.pairs[0].normal_stiffness;
            let gained = energy_gained(bench, &scene);
            // (ω Δt)²/4 of the normal motion: 1e-2 of the energy on the floor, all of it in the corner. f32:
            // velocities.
            let allowed = if walls == 1 { 2.4e-6 } else { 2.4e-4 } + bench.pick(0.0, 2e-6);
            figures.push(Figure::zero(format!("{what}, friction {friction}: energy gained"), allowed, gained));
        }
    }
    figures
}

/// Most energy that any of the impacts gains, in parts of its own.
fn energy_gained(bench: Bench, given: &Assembly) -> f64 {
    let mut scene = given.clone();
    let dt = 1e-6;
    scene.solver.dt = TimeStep::Fixed(dt);
    let speed = given.grains[0].velocity.length();
    scene.grains.clear();
    for slope in [1e-1, 1e-2, 1e-3, 1e-4_f64] {
        for phase in 0..8 {
            let velocity = speed * DVec3::new(-1.0, 0.0, -slope).normalize();
            let y = 3.0 * R * scene.grains.len() as f64;
            // Ten steps from the floor, and a hundred or so from the other wall.
            let height = R - (10.0 + f64::from(phase) / 8.0) * dt * velocity.z;
            let ahead = R - (100.0 + f64::from(phase) / 5.0) * dt * velocity.x;
            scene.grains.push(Grain { velocity, ..grain(ahead, y, height) });
        }
    }
    let after = bench.after(&scene, 600);
    let energy = |g: &Grain| g.velocity.length_squared() + 0.4 * (R * g.spin).length_squared();
    let gained = after.iter().map(|g| energy(g) / speed.powi(2) - 1.0);
    assert!(scene.walls.iter().all(|w: &Wall| after.iter().all(|g| w.surface.distance(g.position) > R)), "still there");
    gained.fold(0.0, worse)
}
