//! Rest, high and long.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::scene;

/// 100 grains on each other: contact i from below carries 100 − i + 1 weights.
pub fn column(bench: Bench, _: Length) -> Vec<Figure> {
    let scene = scene("column_100");
    let n = scene.grains.len();
    let unit = mass(3, R) * G / scene.pairs[0].normal_stiffness;
    let mut simulation = bench.start(&scene);
    simulation.advance(8000).unwrap();
    let grains = simulation.grains().unwrap();
    let heights = std::iter::once(-R).chain(grains.iter().map(|g| g.position.z)).collect::<Vec<_>>();
    let error = |(k, pair): (usize, &[f64])| {
        let expected = (n - k) as f64 * unit;
        ((2.0 * R - (pair[1] - pair[0])) / expected - 1.0).abs()
    };
    let errors: Vec<f64> = heights.windows(2).enumerate().map(error).collect();
    let sample = simulation.sample().unwrap();
    vec![
        Figure::new("grains", 100.0, 0.0, n as f64),
        Figure::new("contacts", 100.0, 0.0, sample.contacts as f64),
        // f64: an ulp of 0.2 m over 1e-7 m, 100 times.
        Figure::zero("overlaps, worst relative error", bench.pick(1e-7, 1e-5), errors.iter().copied().fold(0.0, worse)),
        Figure::zero("overlap of the lowest, relative error", bench.pick(1e-7, 1e-5), errors[0]),
    ]
}

/// A pyramid of five spheres that friction holds, without global damping: after it has settled, nothing moves for 10^6
/// steps.
pub fn resting_pyramid(bench: Bench, length: Length) -> Vec<Figure> {
    let scene = scene("resting_pyramid");
    let mut simulation = bench.start(&scene);
    simulation.advance(20_000).unwrap();
    let settled = simulation.grains().unwrap();
    let energy = simulation.sample().unwrap();
    let (mut creep, mut swing) = (0.0, 0.0);
    for _ in 0..10 {
        simulation.advance(length.of(1_000_000) / 10).unwrap();
        let moved = simulation.grains().unwrap();
        creep =
            worse(creep, moved.iter().zip(&settled).map(|(a, b)| (a.position - b.position).length()).fold(0.0, worse));
        swing = worse(swing, simulation.sample().unwrap().kinetic_energy / energy.elastic_energy);
    }
    let after = simulation.sample().unwrap();
    vec![
        // The lower four spread until they just do not touch.
        Figure::new("contacts", 8.0, 0.0, after.contacts as f64),
        // A hundredth of the overlap that carries a weight.
        Figure::zero("creep over R", 1e-6, creep / R),
        Figure::zero(
            "elastic energy: change",
            bench.pick(1e-6, 1e-4),
            after.elastic_energy / energy.elastic_energy - 1.0,
        ),
        Figure::zero("kinetic over elastic energy at most", bench.pick(1e-12, 1e-8), swing),
    ]
}
