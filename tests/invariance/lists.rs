//! Neighbour lists and chunks are bookkeeping: they leave no trace in the results.

use crate::{bits, common::*, dt, gas, speed, violent};
use glam::DVec3;
use packstone::{scene::Dashpot, simulation::Options, state::array};

/// Lists are bookkeeping: the same bits from run to run, whether lists overflow or not, and however often they are
/// made.
#[test]
fn bookkeeping_leaves_no_trace() {
    for dimension in [2, 3] {
        let (scene, steps) = violent(dimension);
        for bench in engines() {
            let run = |options: Options| {
                let mut simulation = bench.start_with(&scene, options);
                simulation.advance(steps).unwrap();
                assert_eq!(simulation.lost_contacts(), 0, "{} lost contacts", bench.name);
                let sample = simulation.sample().unwrap();
                assert!(sample.contacts > 3, "{sample:?}");
                (bits(&simulation.grains().unwrap()), simulation.replayed_chunks())
            };
            let usual = bench.options();
            let (reference, replayed) = run(Options { entries: Some(100_000), ..usual });
            let overflows = run(Options { entries: Some(1), ..usual });
            let growing = run(Options { entries: Some(scene.grains.len() * 2), ..usual });
            println!("{dimension}D {}: {replayed}, {}, {} replays", bench.name, overflows.1, growing.1);
            assert!(overflows.1 > replayed, "nothing was done again for want of slots");
            for (what, found) in [
                ("again", run(Options { entries: Some(100_000), ..usual }).0),
                ("one slot", overflows.0),
                ("a slot or two per grain", growing.0),
                ("lists every step", run(Options { longest_chunk: 1, ..usual }).0),
                ("lists every three steps", run(Options { longest_chunk: 3, ..usual }).0),
                ("lists side by side", run(Options { lists_abreast: Some(32), ..usual }).0),
            ] {
                assert!(found == reference, "{dimension}D {}: {what}: other bits", bench.name);
            }
        }
    }
}

/// Sums are taken by the numbers of the grains, so that neither the reach of the lists nor the order of the cells
/// changes a bit of a row of the history. More grains than there are rows of partial sums.
#[test]
fn sums_leave_no_trace_of_the_lists() {
    for bench in engines() {
        for (side, dimension) in [(6, 3), (18, 3), (20, 2)] {
            let rows = |margin: f64| {
                let mut scene = gas(dimension, side, 0.5, Dashpot::Restitution(0.7));
                scene.gravity = DVec3::Y * -G;
                scene.solver.margin = margin;
                let mut simulation = bench.start(&scene);
                let mut row = || {
                    simulation.advance(30).unwrap();
                    let s = simulation.sample().unwrap();
                    let energies = [s.kinetic_energy, s.potential_energy, s.elastic_energy, s.dissipation];
                    let ratios = [s.unbalanced_force_ratio, s.max_overlap_over_radius, s.coordination_number];
                    [&energies[..], &ratios].concat().into_iter().map(f64::to_bits).collect::<Vec<_>>()
                };
                (0..3).map(|_| row()).collect::<Vec<_>>()
            };
            let given = rows(0.2);
            for margin in [0.07, 0.5, 1.0, 3.0] {
                assert_eq!(rows(margin), given, "{} {dimension}D {side}, margin {margin}", bench.name);
            }
        }
    }
}

/// A chunk in which a grain outran its margin ends there: a cloud that starts at rest and falls onto a rough
/// floor outruns chunks that grew while it was slow.
#[test]
fn a_chunk_cut_short_leaves_no_trace() {
    for dimension in [2, 3] {
        let side = if dimension == 2 { 6 } else { 4 };
        let mut scene = gas(dimension, side, 0.6, Dashpot::Restitution(0.9));
        scene.grains.iter_mut().for_each(|g| g.velocity *= 0.02);
        scene.grains.iter_mut().for_each(|g| g.spin *= 0.02);
        let n = DVec3::AXES[dimension - 1];
        scene.gravity = 0.01 * speed(dimension) / dt(dimension) * (DVec3::X - n);
        scene.walls = vec![plane(DVec3::ZERO, n)];
        for bench in engines() {
            let run = |longest_chunk: u32| {
                let mut simulation = bench.start_with(&scene, Options { longest_chunk, ..bench.options() });
                simulation.advance(250).unwrap();
                assert!(simulation.sample().unwrap().contacts > 0 && simulation.lost_contacts() == 0);
                (bits(&simulation.grains().unwrap()), simulation.replayed_chunks())
            };
            let (short, long) = (run(1), run(1000));
            println!("{dimension}D {}: {} and {} replays", bench.name, short.1, long.1);
            assert!(long.1 > 0, "no chunk was cut short");
            assert!(short.0 == long.0, "{dimension}D {}: other bits", bench.name);
        }
    }
}

/// Lists that outgrow their room in the middle of a run, while springs are stretched. A thin margin makes the lists as
/// long as there are contacts, and they start empty.
#[test]
fn lists_that_grow_keep_the_springs() {
    for dimension in [2, 3] {
        let (mut scene, _) = violent(dimension);
        scene.solver.margin = 0.03;
        for bench in engines() {
            let run = |slots: usize| {
                let mut simulation = bench.start_with(&scene, Options { entries: Some(slots), ..bench.options() });
                simulation.advance(200).unwrap();
                (bits(&simulation.grains().unwrap()), simulation.lost_contacts())
            };
            let mut simulation = bench.start(&scene);
            let mut needed = |steps: u64| {
                simulation.advance(steps).unwrap();
                simulation.read(&[&array::LIST_START]).unwrap().all_entries()
            };
            let (few, many) = (needed(0), needed(100));
            assert!(many > few + 8, "the lists do not grow: {few} to {many}");
            let (expected, _) = run(100_000);
            for slots in (0..4).map(|k| few + (many - few) * k / 4) {
                let (found, lost) = run(slots);
                let same = found.iter().zip(&expected).filter(|(a, b)| a == b).count();
                println!("{dimension}D {} {slots} slots: {same} grains as with room, {lost} lost", bench.name);
                assert!(found == expected && lost == 0, "{dimension}D {}: {slots} slots: other bits", bench.name);
            }
        }
    }
}
