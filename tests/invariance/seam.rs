//! Contacts across the seam of a periodic domain.

use crate::{bits, common::*, dt, speed, violent};
use glam::DVec3;
use packstone::simulation::Options;

/// A layer of a dense packing creeps to and fro through the seam of a periodic domain: whenever lists are made, also
/// right after a grain has come through it, it sees the same bits.
#[test]
fn the_seam_leaves_no_trace_of_the_lists() {
    for dimension in [2, 3] {
        let (mut scene, _) = violent(dimension);
        let (spacing, mut periods) = (1.97 * R, scene.domain.upper);
        for axis in 0..dimension {
            // At least one of these periods is far from a multiple of the quantum of positions in single precision.
            let period = scene.domain.upper.x / SPACING * spacing + axis as f64 * 1.2e-6 * R;
            for g in &mut scene.grains {
                let at = g.position[axis] / SPACING;
                g.position[axis] = (at.floor() * spacing + 5e-4 * R * (at.fract() - 0.5)).rem_euclid(period);
            }
            periods[axis] = period;
        }
        scene.domain.upper = periods;
        scene.grains.iter_mut().for_each(|g| (g.velocity, g.radius) = (2e-4 * g.velocity, R));
        for bench in engines() {
            let run = |margin: f64, longest_chunk: u32| {
                let mut scene = scene.clone();
                scene.solver.margin = margin;
                let mut simulation = bench.start_with(&scene, Options { longest_chunk, ..bench.options() });
                simulation.advance(120).unwrap();
                assert!(simulation.sample().unwrap().contacts > scene.grains.len() as u64);
                bits(&simulation.grains().unwrap())
            };
            let given = run(0.2, 1000);
            for (margin, longest_chunk) in [(0.2, 1), (0.07, 2), (1.0, 5), (3.0, 1000)] {
                let same = run(margin, longest_chunk).iter().zip(&given).filter(|(a, b)| a == b).count();
                let what = format!("{dimension}D {}, margin {margin}, {longest_chunk} steps", bench.name);
                println!("{what}: {same} of {} grains", given.len());
                assert_eq!(same, given.len(), "{what}: other bits");
            }
        }
    }
}

/// A pair that slides and rolls on each other while it flies through the seam keeps its spring: it does what a pair
/// does that meets no seam.
#[test]
fn a_contact_flies_through_the_seam() {
    for dimension in [2, 3] {
        let drift = 100.0 * speed(dimension);
        let pair = |periodic_domain: bool| {
            let mut scene = blank_dt(dimension, dt(dimension));
            scene.pairs = vec![law(0.5)];
            scene.solver.margin = 1.5;
            let n = DVec3::new(0.6, 0.8, 0.0);
            scene.grains = vec![grain(0.0, 0.0, 0.0), grain(0.0, 0.0, 0.0)];
            scene.grains[1].position = 1.95 * R * n;
            scene.grains[1].spin = DVec3::Z * 20.0 * speed(dimension) / R;
            for g in &mut scene.grains {
                g.position += DVec3::new(8.7 * R, 4.0 * R, 0.0);
                g.velocity = drift * DVec3::new(0.8, 0.6, 0.0);
            }
            scene.walls = if dimension == 3 { vec![plane(DVec3::NEG_Z * 0.999 * R, DVec3::Z)] } else { vec![] };
            if periodic_domain {
                for axis in 0..2 {
                    (scene.domain.lower[axis], scene.domain.upper[axis]) = (0.0, 10.0 * R);
                    scene.domain.periodic[axis] = true;
                }
            }
            scene
        };
        let (closed, open) = (pair(true), pair(false));
        for bench in engines() {
            let (a, b) = (bench.after(&closed, 24), bench.after(&open, 24));
            assert!(b[0].position.x > 10.0 * R && a[0].position.x < 5.0 * R, "it crosses");
            assert!((b[1].spin - open.grains[1].spin).length() > 0.05 * open.grains[1].spin.length(), "it slides");
            // 24 ulp of 10 R, and as much again by the overlap of 0.05 R that they change.
            let found = distance(&closed, &a, &b);
            println!("{dimension}D {}: {found:.1e}", bench.name);
            assert!(found < bench.pick(1e-13, 5e-5), "{dimension}D {}: {found:e}", bench.name);
        }
    }
}
