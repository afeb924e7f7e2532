//! The power of what takes energy, summed over every step: as much as is lost.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::{
    measure::Sample,
    scene::{Assembly, Dashpot, Grain, Pair},
};
use std::f64::consts::{PI, TAU};

fn energy(sample: &Sample) -> f64 {
    sample.kinetic_energy + sample.potential_energy + sample.elastic_energy
}

/// What these steps lose, and what friction and damping are said to take in them, J.
fn lost_and_taken(bench: &Bench, scene: &Assembly, steps: usize) -> (f64, f64) {
    let mut simulation = bench.start(scene);
    let first = energy(&simulation.sample().unwrap());
    let (mut last, mut taken) = (first, 0.0);
    for _ in 0..steps {
        simulation.advance(1).unwrap();
        let sample = simulation.sample().unwrap();
        taken += simulation.dt() * sample.dissipation;
        last = energy(&sample);
    }
    (first - last, taken)
}

/// Two grains about to touch, one of which moves towards the other with speed v: so many steps of contact.
fn impact(dimension: usize, pair: Pair, v: f64, steps: usize) -> Assembly {
    let dt = PI / (2.0_f64.sqrt() * omega(dimension)) / steps as f64;
    let mut scene = blank_dt(dimension, dt);
    scene.pairs = vec![pair];
    let there = (2.0 * R + 0.3 * dt * v) * DVec3::X;
    scene.grains = vec![
        Grain { velocity: DVec3::X * v, ..grain(0.0, 0.0, 0.0) },
        Grain { position: there, ..grain(0.0, 0.0, 0.0) },
    ];
    scene
}

/// Of the energy in the motion towards each other, restitution leaves e². A fixed partner makes the impact longer, and
/// only one side of it is measured.
#[test]
fn dashpots() {
    for bench in engines() {
        for (dimension, fixed) in [(2, false), (3, false), (2, true), (3, true)] {
            let (e, v) = (0.5_f64, 1e-2 * R * omega(dimension));
            let mut scene = impact(dimension, Pair { dashpot: Dashpot::Restitution(e), ..law(0.0) }, v, 100);
            scene.grains[1].fixed = fixed;
            let (lost, taken) = lost_and_taken(&bench, &scene, if fixed { 185 } else { 130 });
            let reduced = if fixed { 1.0 } else { 0.5 } * mass(dimension, R);
            let expected = 0.5 * reduced * v * v * (1.0 - e * e);
            println!(
                "{} {dimension}D: lost {:.1e}, taken {:.1e}",
                bench.name,
                lost / expected - 1.0,
                taken / lost - 1.0
            );
            close("lost", lost, expected, expected, 2e-2);
            close("taken", taken, lost, lost, bench.pick(1e-3, 2e-3));
        }
    }
}

/// A grain that slides until it rolls; what its spring then holds goes on swinging.
#[test]
fn sliding() {
    for bench in engines() {
        for dimension in [2, 3] {
            let (mu, v0, beta) = (0.3, 0.05, gyration(dimension));
            let dt = TAU / stick_frequency(dimension) / 64.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, mu)];
            scene.gravity = -G * up(dimension);
            scene.walls = vec![floor(dimension)];
            let position = up(dimension) * R * (1.0 - 1e-4);
            scene.grains = vec![Grain { position, velocity: DVec3::X * v0, ..grain(0.0, 0.0, 0.0) }];
            let until_rolling = v0 * beta / (1.0 + beta) / (mu * G);
            let (lost, taken) = lost_and_taken(&bench, &scene, (1.2 * until_rolling / dt) as usize);
            let m = mass(dimension, R);
            let swinging = (mu * m * G).powi(2) / (2.0 * scene.pairs[0].tangential_stiffness);
            let expected = 0.5 * m * v0 * v0 * beta / (1.0 + beta) - swinging;
            println!(
                "{} {dimension}D: lost {:.1e}, taken {:.1e}",
                bench.name,
                lost / expected - 1.0,
                taken / expected - 1.0
            );
            close("lost", lost, expected, expected, bench.pick(1e-4, 1e-3));
            close("taken", taken, expected, expected, bench.pick(1e-3, 2e-3));
        }
    }
}

/// Energy of a grain in flight falls as exp(-2 ξ t), that of its spin with it.
#[test]
fn global_damping() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = blank_dt(dimension, 1e-5);
            scene.solver.damping = 20.0;
            let spin = DVec3::Z * 100.0;
            scene.grains = vec![Grain { velocity: DVec3::X * 0.1, spin, ..grain(0.0, 0.0, 0.0) }];
            // Without friction there are no spins.
            scene.pairs = vec![law(0.5)];
            let steps = 2000;
            let m = mass(dimension, R);
            let first = 0.5 * m * (0.01 + gyration(dimension) * (R * 100.0).powi(2));
            let expected = first * (1.0 - (-2.0 * 20.0 * 1e-5 * steps as f64).exp());
            let (lost, taken) = lost_and_taken(&bench, &scene, steps);
            close("lost", lost, expected, expected, bench.pick(1e-6, 1e-4));
            close("taken", taken, expected, expected, bench.pick(5e-4, 6e-4));
        }
    }
}

/// Grains that stick, however strong the pull, part with a stretched spring.
#[test]
fn opening_contacts() {
    for bench in engines() {
        for dimension in [2, 3] {
            let v = 1e-2 * R * omega(dimension);
            let pair = Pair { tangential_stiffness: 0.6 * KN, ..law(1e3) };
            let mut scene = impact(dimension, pair, v, 400);
            scene.grains[0].velocity.y = v;
            let (lost, taken) = lost_and_taken(&bench, &scene, 500);
            let all = 0.5 * mass(dimension, R) * v * v;
            println!("{} {dimension}D: {:.3} lost, taken {:.1e}", bench.name, lost / all, taken / lost - 1.0);
            assert!(lost > 0.1 * all, "{lost:e} of {all:e}");
            close("taken", taken, lost, lost, 1e-4);
        }
    }
}
