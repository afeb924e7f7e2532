//! Grains of very different sizes and masses, and too many in one place.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;
use crate::{
    measure::{masses, momentum},
    scene::{Grain, Material, TimeStep},
    simulation::Simulation,
};
use glam::DVec3;
use std::time::Instant;

/// A sphere between two streams of grains a thirtieth of its size. Contacts are counted again over all pairs.
pub fn size_ratio(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("size_ratio");
    let masses = masses(&scene);
    let scale: f64 = scene.grains.iter().zip(&masses).map(|(g, m)| m * g.velocity.length()).sum();
    let mut simulation = bench.start(&scene);
    let before = simulation.sample().unwrap();
    let (mut missed, mut most, mut energy) = (0.0, 0, 0.0);
    for _ in 0..8 {
        simulation.advance(300).unwrap();
        let sample = simulation.sample().unwrap();
        missed = worse(missed, missing(&simulation.grains().unwrap(), sample.contacts));
        most = most.max(sample.contacts);
        energy = worse(energy, (sample.kinetic_energy + sample.elastic_energy) / before.kinetic_energy - 1.0);
    }
    assert!(most > 20, "hardly anything touches: {most}");
    let moved = momentum(&simulation.grains().unwrap(), &masses) - momentum(&scene.grains, &masses);
    vec![
        Figure::zero("contacts missed or invented", 0.0, missed),
        Figure::zero("contacts whose history is lost", 0.0, simulation.lost_contacts() as f64),
        Figure::zero("change of momentum over Σ m v", bench.pick(1e-13, 1e-6), moved.length() / scale),
        // Friction only takes; elastic touches give and take (ω Δt)² of a grain's share.
        Figure::zero("energy gained at most", 1e-3, energy),
    ]
}

/// By how many `counted` differs from the contacts among all pairs; those within rounding of touching may count or not.
fn missing(grains: &[Grain], counted: u64) -> f64 {
    let gap =
        |i: usize, j: usize| (grains[i].position - grains[j].position).length() - grains[i].radius - grains[j].radius;
    let gaps: Vec<f64> = (0..grains.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| gap(i, j)).collect();
    let within = |slack: f64| gaps.iter().filter(|g| **g < slack).count() as u64;
    // f32: an ulp of 31 R.
    let (sure, possible) = (within(-4e-6 * R), within(4e-6 * R));
    sure.saturating_sub(counted).max(counted.saturating_sub(possible)) as f64
}

/// A light grain on a heavy one, a heavy on a light, and a light one that two heavy ones squeeze; masses 1 : 1e6.
pub fn mass_ratio(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("mass_ratio");
    let masses = masses(&scene);
    let (light, heavy) = (masses[0], masses[1]);
    let v = scene.grains[0].velocity.x;
    let grains = bench.after(&scene, 400);
    let now = |k: usize| grains[k].velocity.x / v;
    let total = light + heavy;
    let mut figures = vec![
        Figure::new("mass ratio", 1e6, 1e-3, heavy / light),
        // (ω Δt)² at 70 steps per contact.
        Figure::new("light on heavy: light", (light - heavy) / total, 2e-3, now(0)),
        Figure::new("light on heavy: heavy × 1e6", 1e6 * 2.0 * light / total, 4e-3, 1e6 * now(1)),
        Figure::new("heavy on light: light", 2.0 * heavy / total, 4e-3, now(3)),
    ];
    let kept = |ids: [usize; 2], before: f64| {
        let after: f64 = ids.iter().map(|k| masses[*k] * grains[*k].velocity.x).sum();
        (after / before - 1.0).abs()
    };
    // The heavy one loses 2e-6 of its speed in 70 steps: in f32 a quarter of an ulp in each, so all of it may be lost.
    figures.push(Figure::zero("light on heavy: momentum", bench.pick(1e-13, 1e-5), kept([0, 1], light * v)));
    figures.push(Figure::zero("heavy on light: momentum", bench.pick(1e-13, 3e-6), kept([2, 3], heavy * v)));
    figures.extend(squeezed(bench));
    figures
}

fn squeezed(bench: Bench) -> Vec<Figure> {
    let mut scene = blank_dt(3, 2e-7); // a seventh of the light one's critical step
    scene.materials = [RHO * 1e-3, RHO * 1e3].map(|density| Material { name: String::new(), density }).to_vec();
    scene.pairs = vec![law(0.0); 4];
    let v = 0.02;
    scene.grains = vec![Grain { velocity: DVec3::X * 0.1, ..grain(0.0, 0.0, 0.0) }];
    for side in [-1.0, 1.0] {
        scene.grains.push(Grain { material: 1, velocity: DVec3::X * -side * v, ..grain(side * 2.0 * R, 0.0, 0.0) });
    }
    let masses = masses(&scene);
    let energy = |grains: &[Grain]| -> f64 {
        grains.iter().zip(&masses).map(|(g, m)| 0.5 * m * g.velocity.length_squared()).sum()
    };
    // π √(2 M / k_N · ½ · 2 …): two springs in series between two equal masses swing with √(k_N/M).
    let steps = (1.3 * std::f64::consts::PI * (masses[1] / KN).sqrt() / 2e-7) as u64;
    let grains = bench.after(&scene, steps);
    let apart = grains[1].velocity.x < 0.0 && grains[2].velocity.x > 0.0;
    assert!(apart, "the heavy ones part again");
    let light = masses[0] * 0.1;
    let p = momentum(&grains, &masses).x - light;
    vec![
        // f32: the force on the heavy ones rounds to 1e-7 of itself in each of 16,000 steps.
        Figure::new("squeezed: energy after over before", 1.0, 2e-4, energy(&grains) / energy(&scene.grains)),
        Figure::zero("squeezed: momentum over M v", bench.pick(1e-12, 2e-5), p.abs() / masses[1] / v),
    ]
}

/// 10,000 grains within a tenth of a radius, which no list can hold cheaply: it ends in bounded time, and if it does
/// not run, it says why.
pub fn collapsed(bench: Bench, _: Length) -> Vec<Figure> {
    let mut scene = blank(3);
    let mut random = Random(5);
    scene.grains = (0..10_000)
        .map(|_| {
            let at = 0.05 * R * random.vector(3);
            grain(at.x, at.y, at.z)
        })
        .collect();
    scene.solver.allow_unstable = true;
    scene.solver.dt = TimeStep::Fixed(1e-9);
    let started = Instant::now();
    let outcome = Simulation::new(scene, bench.options()).and_then(|mut s| s.advance(1).map(|()| s));
    let seconds = started.elapsed().as_secs_f64();
    let said = match &outcome {
        Ok(_) => 1.0,
        Err(e) => f64::from(u8::from(e.to_string().contains("grains"))),
    };
    vec![
        Figure::new("runs, or says why not", 1.0, 0.0, said),
        // 1e8 pairs, four times, at 1e7 pairs/s on one busy core.
        Figure::new("seconds until then", 30.0, 30.0, seconds),
    ]
}
