//! Momentum and energy.

use crate::{common::*, dt, gas, periodic, speed};
use glam::DVec3;
use packstone::{
    measure::{angular_momentum, masses, momentum},
    scene::{Dashpot, Grain},
};

/// Momentum, linear and angular, of isolated frictional grains with dashpots: every force has its opposite, and both
/// act at one point (erratum E7).
#[test]
fn momentum_is_conserved() {
    let mut pair = gas(3, 2, 0.5, Dashpot::Restitution(0.8));
    pair.grains.truncate(2);
    pair.grains[1].position = pair.grains[0].position + 1.9 * R * DVec3::new(1.0, 2.0, 2.0).normalize();
    pair.grains[1].velocity = -pair.grains[0].velocity + DVec3::new(0.0, -0.5 * speed(3), 0.0);
    let scenes = [
        ("pair", pair),
        ("2D gas", gas(2, 10, 0.5, Dashpot::Restitution(0.8))),
        ("3D gas", gas(3, 5, 0.5, Dashpot::None)),
    ];
    for (name, scene) in scenes {
        let masses = masses(&scene);
        let scale: f64 = scene.grains.iter().zip(&masses).map(|(g, m)| m * g.velocity.length()).sum();
        let extent = scene.grains.iter().map(|g| g.position.length()).fold(R, f64::max);
        for bench in engines() {
            let after = bench.after(&scene, 400);
            let moved = after.iter().zip(&scene.grains).map(|(a, b)| (a.velocity - b.velocity).length());
            assert!(moved.fold(0.0, f64::max) > 0.3 * speed(scene.dimension), "nothing collides");
            let linear = (momentum(&after, &masses) - momentum(&scene.grains, &masses)).length() / scale;
            let of = |grains: &[Grain]| angular_momentum(&scene, grains, &masses).expect("an open domain");
            let angular = of(&after) - of(&scene.grains);
            let angular = angular.length() / scale / extent;
            println!("{name} on {}: momentum {linear:.1e}, angular {angular:.1e}", bench.name);
            assert!(linear < bench.pick(1e-13, 1e-6), "{name} on {}: momentum {linear:e}", bench.name);
            // f32: a constant velocity is rounded the same way step after step, up to 400 half ulp of 3e-3 m.
            assert!(angular < bench.pick(1e-13, 1e-5), "{name} on {}: angular {angular:e}", bench.name);
        }
    }
}

/// Energy of an elastic frictionless gas: leapfrog conserves it on average, each touch costs (ω Δt)², random in sign.
#[test]
fn energy_of_an_elastic_gas() {
    let scene = periodic(gas(2, 8, 0.0, Dashpot::None), 8);
    let worst = |refine: u64| {
        let mut scene = scene.clone();
        scene.solver.dt = packstone::scene::TimeStep::Fixed(dt(2) / refine as f64);
        let mut simulation = CPU.start(&scene);
        let energy = |s: packstone::measure::Sample| s.kinetic_energy + s.elastic_energy;
        let first = energy(simulation.sample().unwrap());
        let mut worst: f64 = 0.0;
        for _ in 0..60 {
            simulation.advance(20 * refine).unwrap();
            worst = worst.max((energy(simulation.sample().unwrap()) / first - 1.0).abs());
        }
        worst
    };
    let (coarse, fine) = (worst(1), worst(4));
    println!("energy: {coarse:.1e}, with a quarter of the step {fine:.1e}");
    assert!(coarse < 2e-3 && fine < coarse / 8.0, "{coarse:e} {fine:e}");
}

/// Energy with friction but without sliding: an isolated pair that sticks keeps kinetic, normal and tangential energy.
#[test]
fn energy_of_a_sticking_pair() {
    for dimension in [2, 3] {
        let mut scene = blank_dt(dimension, dt(dimension) / 20.0);
        scene.pairs = vec![law(1e3)];
        scene.grains = vec![grain(0.0, 0.0, 0.0), grain(2.0 * R, 0.0, 0.0)];
        let v = 0.05 * speed(dimension);
        scene.grains[0].velocity = DVec3::new(v, v, 0.0);
        let mut simulation = CPU.start(&scene);
        let first = simulation.sample().unwrap().kinetic_energy;
        let mut exchanged: f64 = 0.0;
        for _ in 0..90 {
            simulation.advance(10).unwrap();
            let s = simulation.sample().unwrap();
            exchanged = exchanged.max(s.elastic_energy / first);
            close("energy", s.kinetic_energy + s.elastic_energy, first, first, 3e-3);
        }
        assert!(exchanged > 0.2, "{exchanged}");
    }
}
