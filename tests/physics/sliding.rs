//! Sliding, rolling and sticking on flat surfaces.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Assembly, Grain, Pair};
use std::f64::consts::TAU;

/// R1: slides with -μ g, then rolls at 5/7 (disk 2/3) of the speed. With no dashpot along the tangent, the spring that
/// friction has stretched keeps swinging: with amplitude μ g/Ω around rolling, which is part of the closed form.
#[test]
fn sliding_becomes_rolling() {
    for bench in engines() {
        for (dimension, frame) in [2, 3].into_iter().flat_map(|d| frames(d).map(|frame| (d, frame))) {
            let (mu, v0) = (0.3, 0.05);
            let swing = stick_frequency(dimension);
            let dt = TAU / swing / 64.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, mu)];
            scene.gravity = -G * up(dimension);
            scene.walls = vec![floor(dimension)];
            let mut g = grain(0.0, 0.0, 0.0);
            g.position = up(dimension) * R * (1.0 - 1e-4);
            g.velocity = DVec3::X * v0;
            scene.grains = vec![g];
            let beta = gyration(dimension);
            let (until_rolling, rolling) = (v0 * beta / (1.0 + beta) / (mu * G), v0 / (1.0 + beta));
            let half = (0.5 * until_rolling / dt) as u64;
            let mut simulation = frame.start(&bench, &scene);
            simulation.advance(half);
            let v = simulation.grains()[0].velocity.x;
            // The spring starts at rest and is full within the first step, so friction acts from half a step on.
            assert!(mu * 1e-4 * R / (2.0 / 7.0) < v0 * dt);
            let expected = v0 - mu * G * (half as f64 - 0.5) * dt;
            close("sliding", v, expected, v0, bench.pick(1e-9, 1e-3));
            simulation.advance((1.2 * until_rolling / dt) as u64 - half);
            let (mut sum, mut low, mut high, mut slip) = (0.0, INF, -INF, 0.0);
            for _ in 0..5 * 16 {
                simulation.advance(4);
                let g = simulation.grains()[0];
                let v = g.velocity.x;
                sum += v / 80.0;
                slip += (v + g.spin.cross(-up(dimension) * R).x) / 80.0;
                (low, high) = (v.min(low), v.max(high));
            }
            println!(
                "{} {dimension}D {frame:?}: v/v0 off by {:.1e}, slip {:.1e}",
                bench.name,
                (sum - rolling) / v0,
                slip / v0
            );
            close("rolling speed", sum, rolling, v0, bench.pick(2e-4, 2e-3));
            close("slip", slip, 0.0, v0, bench.pick(2e-4, 2e-3));
            let amplitude = mu * G / swing;
            close("swing", 0.5 * (high - low), amplitude, amplitude, bench.pick(0.02, 0.1));
        }
    }
}

/// R2: from rest on an incline, rolls without slip iff tan θ ≤ (1 + 1/β) μ; accelerations and growth of the slip. The
/// plane is tilted, not gravity. Averages over whole swings of the spring.
#[test]
fn incline() {
    for dimension in [2, 3] {
        let theta: f64 = 0.3;
        let c = 1.0 + 1.0 / gyration(dimension);
        let swings = 64;
        let dt = TAU / stick_frequency(dimension) / f64::from(swings);
        let ratios = [0.3, 0.98, 1.02, 1.5, 3.0]; // tan θ over its threshold
        let mut scene = blank_dt(dimension, dt);
        let laws: Vec<Pair> = ratios.iter().map(|r| bed_law(dimension, theta.tan() / c / r)).collect();
        set_laws(&mut scene, &laws);
        let (normal, down) = if dimension == 2 {
            (DVec3::new(theta.sin(), theta.cos(), 0.0), DVec3::new(theta.cos(), -theta.sin(), 0.0))
        } else {
            (DVec3::new(0.0, theta.sin(), theta.cos()), DVec3::new(0.0, theta.cos(), -theta.sin()))
        };
        scene.gravity = -G * up(dimension);
        scene.walls = vec![plane(DVec3::ZERO, normal)];
        for material in 0..ratios.len() as u32 {
            let along = if dimension == 2 { down } else { DVec3::X };
            let position = normal * R * (1.0 - 1e-4 * theta.cos()) + 8.0 * R * f64::from(material) * along;
            scene.grains.push(Grain { position, material, ..grain(0.0, 0.0, 0.0) });
        }
        for frame in frames(dimension) {
            let mut simulation = frame.start(&CPU, &scene);
            let mut mean = || {
                let mut sums = vec![(0.0, 0.0); ratios.len()];
                for _ in 0..swings {
                    simulation.advance(1);
                    for (sum, g) in sums.iter_mut().zip(simulation.grains()) {
                        let v = g.velocity.dot(down) / f64::from(swings);
                        sum.0 += v;
                        sum.1 += v + g.spin.cross(-R * normal).dot(down) / f64::from(swings);
                    }
                }
                let now = simulation.time();
                simulation.advance(2000);
                (now, sums)
            };
            mean(); // the start, with its transient
            let (t0, before) = mean();
            let (t1, after) = mean();
            for (k, ratio) in ratios.iter().enumerate() {
                let mu = theta.tan() / c / ratio;
                let (a, slip) = ((after[k].0 - before[k].0) / (t1 - t0), (after[k].1 - before[k].1) / (t1 - t0));
                let (expected, expected_slip) = if *ratio <= 1.0 {
                    (G * theta.sin() * (c - 1.0) / c, 0.0)
                } else {
                    (G * (theta.sin() - mu * theta.cos()), G * (theta.sin() - c * mu * theta.cos()))
                };
                println!("{dimension}D {ratio}: a {:.1e}, slip {:.1e}", a / expected - 1.0, (slip - expected_slip) / G);
                close("acceleration", a, expected, G, 3e-4);
                close("growth of slip", slip, expected_slip, G, 3e-4);
            }
        }
    }
}

/// A grain squeezed between two plates cannot roll, so it is a block on a frictional surface: it rests iff the pull is
/// at most 2 μ N. Damped critically, rest is at pull/2k_T and sliding at (pull − 2 μ N)/m ξ.
fn squeezed(dimension: usize, ratios: &[f64]) -> (Assembly, f64, f64, f64) {
    let overlap = 1e-3 * R;
    let m = mass(dimension, R);
    let kt = 2.0 / 7.0 * KN;
    let frequency = (2.0 * kt / m).sqrt();
    let pull = 2.0 * KN * overlap * 0.4; // N, along x
    let mut scene = blank_dt(dimension, 0.05 / frequency);
    let laws: Vec<Pair> = ratios.iter().map(|r| law(0.4 / r)).collect();
    set_laws(&mut scene, &laws);
    scene.gravity = DVec3::X * pull / m;
    scene.solver.damping = 2.0 * frequency;
    let n = up(dimension);
    scene.walls = vec![plane(-n * (R - overlap), n), plane(n * (R - overlap), -n)];
    for material in 0..ratios.len() as u32 {
        let along = if dimension == 2 { DVec3::X } else { DVec3::Y };
        scene.grains.push(Grain { material, position: 3.0 * R * f64::from(material) * along, ..grain(0.0, 0.0, 0.0) });
    }
    (scene, pull, kt, m)
}

#[test]
fn block_between_plates() {
    let ratios = [0.5, 0.99, 1.01, 2.0]; // pull over its threshold
    for bench in engines() {
        for dimension in [2, 3] {
            let (scene, pull, kt, m) = squeezed(dimension, &ratios);
            let after = bench.after(&scene, 700);
            for ((g, g0), ratio) in after.iter().zip(&scene.grains).zip(ratios) {
                let limit = pull / ratio; // 2 μ N
                let rest = pull / (2.0 * kt);
                let terminal = (pull - limit) / m / scene.solver.damping;
                let what = format!("{} {dimension}D ratio {ratio}", bench.name);
                close(
                    &format!("{what}: spin"),
                    g.spin.length() * R,
                    0.0,
                    pull / m / scene.solver.damping,
                    bench.pick(1e-12, 1e-3),
                );
                if ratio < 1.0 {
                    close(&what, g.position.x - g0.position.x, rest, rest, bench.pick(1e-9, 5e-3));
                    close(&what, g.velocity.x, 0.0, pull / m / scene.solver.damping, bench.pick(1e-9, 1e-3));
                } else {
                    // f32: the overlap of 1e-3 R is only known to 1e-4 to 1e-3, and with it the limit.
                    close(&what, g.velocity.x, terminal, pull / m / scene.solver.damping, bench.pick(1e-9, 2e-3));
                }
            }
        }
    }
}
