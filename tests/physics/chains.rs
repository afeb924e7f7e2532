//! Chains of grains: columns at rest, cradles.

use crate::{common::*, shared::*};
use packstone::scene::{Grain, Pair};
use std::f64::consts::PI;

/// N8: columns at rest; the contact below grain i of n carries (n − i) weights.
#[test]
fn columns_at_rest() {
    for bench in engines() {
        for (dimension, n) in [(2, 2), (3, 2), (2, 5), (3, 5)] {
            let m = mass(dimension, R);
            let kn = m * G / (5e-3 * R);
            let w = (kn / m).sqrt();
            let mut scene = blank_dt(dimension, 0.2 / w);
            scene.pairs = vec![Pair { normal_stiffness: kn, ..law(0.0) }];
            scene.gravity = -G * up(dimension);
            scene.solver.damping = 0.6 * w;
            scene.walls = vec![floor(dimension)];
            let at = |k: usize| Grain { position: up(dimension) * R * (1.0 + 2.0 * k as f64), ..grain(0.0, 0.0, 0.0) };
            scene.grains = (0..n).map(at).collect();
            let mut simulation = bench.start(&scene);
            simulation.advance(700).unwrap();
            let grains = simulation.grains().unwrap();
            let mut below = -R;
            for (k, g) in grains.iter().enumerate() {
                let height = g.position.dot(up(dimension));
                let overlap = 2.0 * R - (height - below);
                let expected = (n - k) as f64 * m * G / kn;
                // f32: ulp of 9 mm, 9e-10 m, over 5e-6 m.
                close(bench.name, overlap, expected, expected, bench.pick(1e-10, 4e-4));
                below = height;
            }
            let sample = simulation.sample().unwrap();
            assert_eq!(sample.contacts, n as u64);
            // A weight is 5e-3 R of overlap, of which f32 resolves 2e-4.
            assert!(sample.unbalanced_force_ratio < bench.pick(1e-10, 1e-3), "{sample:?}");
        }
    }
}

/// N9: touching elastic spheres, and N10: the same with gaps. Numbers of the linear chain, independent of k, m, v.
#[test]
fn newtons_cradle() {
    const TOUCHING: [&[f64]; 4] = [
        &[0.0, 1.0],
        &[-0.130262, 0.150230, 0.980032],
        &[-0.132275, -0.064975, 0.236978, 0.960272],
        &[-0.132279, -0.075329, -0.031011, 0.296218, 0.942402],
    ];
    let w = omega(3) * 2.0_f64.sqrt();
    let v = 5e-3 * R * w;
    let scene = |resolution: f64| {
        let mut scene = blank_dt(3, PI / w / resolution);
        for (row, chain) in TOUCHING.iter().enumerate() {
            for gap in [0.0, 0.05 * R] {
                for k in 0..chain.len() {
                    let y = 3.0 * R * row as f64 + if gap > 0.0 { 15.0 * R } else { 0.0 };
                    let mut g = grain((2.0 * R + gap) * k as f64, y, 0.0);
                    g.velocity.x = if k == 0 { v } else { 0.0 };
                    scene.grains.push(g);
                }
            }
        }
        scene
    };
    let check = |bench: Bench, variant: Variant, resolution: f64, touching: f64, apart: f64| {
        // Five gaps of 0.05 R at 5e-3 R ω, and the contacts: 0.05/5e-3/π = 3.2 tc per gap.
        let grains = variant.after(&bench, &scene(resolution), (20.0 * resolution) as u64);
        let mut rest = grains.as_slice();
        for chain in TOUCHING {
            for (k, expected) in chain.iter().enumerate() {
                close("touching", rest[k].velocity.x / v, *expected, 1.0, touching);
                let last = if k + 1 == chain.len() { 1.0 } else { 0.0 };
                close("apart", rest[chain.len() + k].velocity.x / v, last, 1.0, apart);
            }
            rest = &rest[2 * chain.len()..];
        }
    };
    check(CPU, AT_REST, 500.0, 1e-5, 1e-4);
    for bench in engines() {
        for variant in frames(3) {
            check(bench, variant, 50.0, bench.pick(1e-3, 3e-3), bench.pick(5e-3, 5e-3));
        }
    }
}
