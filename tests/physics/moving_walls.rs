//! Walls that move or bend: belts, drums, a bowl.

use crate::{common::*, shared::*};
use glam::DVec3;
use std::f64::consts::TAU;

/// A belt (plane moving along itself) sets a free grain rolling at β/(1+β) of its speed, two belts with the grain
/// between them carry it at their speed, and belts that run against each other only spin it.
#[test]
fn belts() {
    for dimension in [2, 3] {
        let n = up(dimension);
        let u = 0.02;
        let m = mass(dimension, R);
        let weight = m * G;
        let kn = bed_law(dimension, 0.3).normal_stiffness;
        let overlap = weight / kn;
        let beta = gyration(dimension);
        // velocity of the floor, of a ceiling if any, and what the grain should do: speed, surface speed of the spin
        let cases = [(u, None, u * beta / (1.0 + beta), u / (1.0 + beta)), (u, Some(u), u, 0.0), (u, Some(-u), 0.0, u)];
        for (below, above, speed, spinning) in cases {
            let swing = stick_frequency(dimension);
            let dt = TAU / (2.0 * swing) / 40.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, 0.3)];
            scene.walls = vec![plane(-n * (R - overlap), n)];
            scene.walls[0].velocity = DVec3::X * below;
            match above {
                None => scene.gravity = -G * n,
                Some(above) => {
                    scene.walls.push(plane(n * (R - overlap), -n));
                    scene.walls[1].velocity = DVec3::X * above;
                }
            }
            scene.grains = vec![grain(0.0, 0.0, 0.0)];
            let mut simulation = CPU.start(&scene);
            simulation.advance(3 * (u / (0.3 * G) / dt) as u64).unwrap();
            let samples = 2000;
            let (mut v, mut s) = (0.0, 0.0);
            for _ in 0..samples {
                simulation.advance(1).unwrap();
                let g = simulation.grains().unwrap()[0];
                v += g.velocity.x / f64::from(samples);
                // The floor drags the lower side along +x: ω × (-R n) points along +x.
                s += g.spin.cross(-R * n).x / f64::from(samples);
            }
            close("speed", v, speed, u, 1e-3);
            close("surface speed", s, spinning, u, 1e-3);
            let moved = simulation.walls().unwrap()[0].surface;
            let packstone::scene::Surface::Plane { point, .. } = moved else { panic!("a plane") };
            close("wall", point.x, below * simulation.time(), R, 1e-9);
        }
    }
}

/// A grain that rides on the inside of a spinning drum without gravity: no slip, constant speed, exactly on a circle
/// with overlap m Ω² r/k. Leapfrog shifts the phase by (Ω Δt)²/24 of it and the radius as little.
#[test]
fn riding_a_drum() {
    for bench in engines() {
        for dimension in [2, 3] {
            for sign in [-1.0, 1.0] {
                let (drum, steps) = (5.0 * R, 800);
                let m = mass(dimension, R);
                let spin = sign * 0.03 * omega(dimension);
                let overlap = m * spin * spin * (drum - R) / (KN - m * spin * spin);
                let r = drum - R + overlap;
                let dt = TAU / spin.abs() / 2.0 / f64::from(steps); // half a turn
                let mut scene = blank_dt(dimension, dt);
                scene.solver.allow_unstable = true;
                scene.pairs = vec![law(0.5)];
                let mut wall = cylinder(drum);
                wall.spin = spin;
                scene.walls = vec![wall];
                let mut g = grain(r, 0.0, 0.0);
                g.velocity = DVec3::Y * spin * r;
                g.spin = DVec3::Z * spin;
                scene.grains = vec![g];
                let after = bench.after(&scene, steps as u64)[0];
                let tolerance = bench.pick(2e-5, 1e-3);
                close("x", after.position.x, -r, r, tolerance);
                close("y", after.position.y, 0.0, r, tolerance);
                close("spin", after.spin.z, spin, spin.abs(), tolerance);
                close("speed", after.velocity.y, -spin * r, (spin * r).abs(), tolerance);
            }
        }
    }
}

/// A grain at rest at the bottom of a spinning drum slides: its spin grows by μ g/(β R) per second and it is pushed
/// along with μ g, both in the sense of the drum.
#[test]
fn slipping_in_a_drum() {
    for sign in [-1.0, 1.0] {
        let (mu, drum) = (0.05, 20.0 * R);
        let dt = 0.05 / stick_frequency(2);
        let mut scene = blank_dt(2, dt);
        scene.pairs = vec![bed_law(2, mu)];
        scene.gravity = -G * DVec3::Y;
        let mut wall = cylinder(drum);
        wall.spin = sign * 100.0;
        scene.walls = vec![wall];
        scene.grains = vec![grain(0.0, -(drum - R * (1.0 - 1e-4)), 0.0)];
        let g = CPU.after(&scene, 400)[0];
        let t = 400.0 * dt;
        close("spin", g.spin.z, sign * mu * G * t / (0.5 * R), mu * G * t / (0.5 * R), 1e-2);
        close("push", g.velocity.x, sign * mu * G * t, mu * G * t, 1e-2);
    }
}

/// Small swings inside a circle: T = 2π √(L/g) without friction, L the distance of the centres, and √(1 + β) times as
/// long for a grain that rolls. Amplitude a adds a²/16; the tangential spring's own compliance adds g/(Ω² L) or so.
#[test]
fn pendulum() {
    for (dimension, friction) in [(2, 0.0), (2, 0.8), (3, 0.8)] {
        let drum = 6.0 * R;
        let length = drum - R + 1e-4 * R;
        let (amplitude, dt) = (0.02_f64, 0.1 / stick_frequency(2));
        let mut scene = blank_dt(dimension, dt);
        scene.pairs = vec![bed_law(dimension, friction)];
        scene.gravity = -G * DVec3::Y;
        scene.walls = vec![cylinder(drum)];
        let at = length * DVec3::new(amplitude.sin(), -amplitude.cos(), 0.0);
        scene.grains = vec![grain(at.x, at.y, 0.0)];
        let mut simulation = CPU.start(&scene);
        let factor = if friction > 0.0 { (1.0 + gyration(dimension)).sqrt() } else { 1.0 };
        let period = TAU * (length / G).sqrt() * factor;
        // Time between the first and the third passage through the bottom.
        let mut passages = Vec::new();
        let mut last = at.x;
        while passages.len() < 3 && simulation.time() < 2.0 * period {
            simulation.advance(1).unwrap();
            let x = simulation.grains().unwrap()[0].position.x;
            if last * x < 0.0 {
                passages.push(simulation.time() - dt * x / (x - last));
            }
            last = x;
        }
        let found = passages[2] - passages[0];
        println!("pendulum {dimension}D friction {friction}: {:.1e}", found / period - 1.0);
        close("period", found, period, period, 3e-4);
    }
}
