//! Columns of rigid grains, and of springs beside them: the load on a contact is the weight above it.

use super::common::*;
use super::figure::{Figure, Length, worse};
use super::scenes::{compliant, loads, relaxation, scene, solved_to};
use crate::{
    measure::masses,
    scene::{Assembly, Grain},
    solve::Solver,
};
use glam::DVec3;
use std::f64::consts::PI;

/// Stiffness of a spring that one weight compresses by 1e-6 R, N/m.
fn stiffness() -> f64 {
    mass(3, R) * G / (1e-6 * R)
}

/// N grains of the scene, each touching the next.
fn column(n: usize) -> Assembly {
    let mut scene = scene("rigid_column");
    let first = scene.grains[0];
    let height = |k: usize| R * (1.0 + 2.0 * k as f64);
    scene.grains = (0..n).map(|k| Grain { position: height(k) * DVec3::Z, ..first }).collect();
    scene
}

/// Largest error of any contact's load, in parts of the load on the floor.
fn error(scene: &Assembly, loads: &[f64]) -> f64 {
    let weights: Vec<f64> = masses(scene).into_iter().map(|m| m * G).collect();
    let (floor, mut above) = (weights.iter().sum::<f64>(), 0.0);
    weights.iter().zip(loads).rev().fold(0.0, |worst, (weight, load)| {
        above += weight;
        worse(worst, (load - above).abs() / floor)
    })
}

/// Slowest angular frequency of N equal grains on springs that stand on a floor, rad/s.
fn slowest(n: usize) -> f64 {
    2.0 * (stiffness() / mass(3, R)).sqrt() * (PI / (4 * n + 2) as f64).sin()
}

/// A step of 0.2 √(m/k_N), s.
fn short_step() -> f64 {
    0.2 * (mass(3, R) / stiffness()).sqrt()
}

/// 10, 100 and 1000 grains. A residual of ε leaves relative velocities of g Δt ε √N, which add up to at most g Δt ε N
/// along the column: no load is off by more than N ε of that on the floor.
pub fn rigid_column(bench: Bench, length: Length) -> Vec<Figure> {
    let mut figures = Vec::new();
    // A thousand take a device minutes, launch by launch.
    let heights: &[usize] = if length == Length::Full || bench.name == "cpu" { &[10, 100, 1000] } else { &[10, 100] };
    for &n in heights {
        // f32: a contact under 1000 weights tells velocities of 6e-8 · 2000 g Δt only, so that steps may end unsolved.
        let tolerance = bench.pick(1e-7, 1e-5);
        let unsolved = if n == 1000 { bench.pick(0.0, 21.0) } else { 0.0 };
        let given = solved_to(column(n), tolerance);
        let mut simulation = bench.start(&given);
        let mut after = |what: &str, steps: u64| {
            simulation.advance(steps).unwrap();
            let loads = loads(&mut simulation);
            let limit = n as f64 * tolerance;
            figures.push(Figure::zero(format!("CD: {n} grains, worst load {what}"), limit, error(&given, &loads)));
            loads[0] / (n as f64 * mass(3, R) * G)
        };
        after("of the first step", 1);
        let floor = after("20 steps later", 20);
        let solved = *simulation.solver_statistics().unwrap();
        figures.push(Figure::new(format!("CD: {n} grains, floor over N m g"), 1.0, n as f64 * tolerance, floor));
        figures.push(Figure::zero(format!("CD: {n} grains, steps not solved"), unsolved, solved.unconverged as f64));
        let mut simulation = bench.start(&compliant(&given, stiffness(), short_step(), 2.0 * slowest(n)));
        // Critically damped in the slowest mode: (1 + ω t) e^(−ω t) is left, 2e-10 at ω t = 26.
        simulation.advance((26.0 / slowest(n) / short_step()) as u64).unwrap();
        let loads = loads(&mut simulation);
        let limit = bench.pick(1e-8, 1e-5);
        figures.push(Figure::zero(format!("DEM: {n} grains, worst load at rest"), limit, error(&given, &loads)));
        let floor = loads[0] / (n as f64 * mass(3, R) * G);
        figures.push(Figure::new(format!("DEM: {n} grains, floor over N m g"), 1.0, limit, floor));
    }
    figures
}

/// Nine grains carry a tenth that is a thousand times as heavy.
pub fn rigid_heavy_top(bench: Bench, _: Length) -> Vec<Figure> {
    // f32: the load of 1009 weights is known to 6e-5 of one, and so is every light grain's acceleration to 6e-5 g.
    let tolerance = bench.pick(1e-7, 1e-3);
    let given = solved_to(scene("rigid_heavy_top"), tolerance);
    let total = masses(&given).iter().sum::<f64>();
    let limit = 10.0 * tolerance;
    let mut simulation = bench.start(&given);
    simulation.advance(1).unwrap();
    let first = error(&given, &loads(&mut simulation));
    simulation.advance(20).unwrap();
    let solved = *simulation.solver_statistics().unwrap();
    let last = loads(&mut simulation);
    let mut figures = vec![
        Figure::zero("CD: worst load of the first step", limit, first),
        Figure::zero("CD: worst load 20 steps later", limit, error(&given, &last)),
        Figure::new("CD: floor over weight", 1.0, limit, last[0] / (total * G)),
        Figure::zero("CD: steps not solved", 0.0, solved.unconverged as f64),
    ];
    // The heavy grain on ten springs in a row; the others are almost without mass.
    let slowest = (stiffness() / 10.0 / total).sqrt();
    let mut simulation = bench.start(&compliant(&given, stiffness(), short_step(), 2.0 * slowest));
    simulation.advance((26.0 / slowest / short_step()) as u64).unwrap();
    let last = loads(&mut simulation);
    let limit = bench.pick(1e-7, 1e-5);
    figures.push(Figure::zero("DEM: worst load at rest", limit, error(&given, &last)));
    figures.push(Figure::new("DEM: floor over weight", 1.0, limit, last[0] / (total * G)));
    figures
}

/// Passes from nothing until every load is known to 1 % of that on the floor. Of the error at the start, 8/π² is in the
/// slowest mode, which a pass of step 1/L shortens by (π/(2N+1))²/4. So plain passes take ln(100 · 8/π²)/that = 7.12
/// N²; with momentum that mode goes as 2 J₁(x)/x, x = n π/(2 (2N+1)) in pass n, and is gone at its first zero, x =
/// 3.83: 4.88 N passes. DEM that is critically damped in the slowest mode needs the time in which (1 + ω t) e^(−ω t)
/// falls to π²/800: ω t = 6.40.
pub fn rigid_passes(bench: Bench, _: Length) -> Vec<Figure> {
    let mut figures = Vec::new();
    let exponent = |counts: &[(usize, f64)]| {
        let ((first, few), (last, many)) = (counts[0], counts[counts.len() - 1]);
        (many / few).ln() / (last as f64 / first as f64).ln()
    };
    let count = |solver: Solver, n: usize, low: f64| {
        first_that(low, |most| {
            let mut given = solved_to(column(n), 1e-12);
            (relaxation(&mut given).solver, relaxation(&mut given).max_iterations) = (solver, most as u32);
            let mut simulation = bench.start(&given);
            simulation.advance(1).unwrap();
            error(&given, &loads(&mut simulation)) < 0.01
        })
    };
    let plain: Vec<(usize, f64)> = [10, 30, 100].map(|n| (n, count(Solver::Jacobi, n, 6.5 * (n * n) as f64))).to_vec();
    for (n, passes) in &plain {
        figures.push(Figure::new(
            format!("CD, plain: {n} grains, passes over N²"),
            7.12,
            0.36,
            passes / (n * n) as f64,
        ));
    }
    figures.push(Figure::new("CD, plain: exponent", 2.0, 0.05, exponent(&plain)));
    let momentum: Vec<(usize, f64)> =
        [10, 100, 1000].map(|n| (n, count(Solver::JacobiAccelerated, n, 4.0 * n as f64))).to_vec();
    for (n, passes) in &momentum {
        // The fast modes are gone too when there are many passes; ten grains have none to spare.
        let limit = if *n == 10 { 1.0 } else { 0.25 };
        figures.push(Figure::new(format!("CD, momentum: {n} grains, passes over N"), 4.88, limit, passes / *n as f64));
    }
    figures.push(Figure::new("CD, momentum: exponent", 1.0, 0.05, exponent(&momentum)));
    let springs: Vec<(usize, f64)> = [10, 100, 1000]
        .map(|n| {
            let given = compliant(&column(n), stiffness(), short_step(), 2.0 * slowest(n));
            let mut simulation = bench.start(&given);
            let expected = 6.40 / slowest(n) / short_step();
            simulation.advance((0.8 * expected) as u64).unwrap();
            while error(&given, &loads(&mut simulation)) > 0.01 {
                simulation.advance((0.005 * expected).ceil() as u64).unwrap();
            }
            (n, simulation.step() as f64)
        })
        .to_vec();
    for (n, steps) in &springs {
        let expected = 6.40 / slowest(*n) / short_step() / *n as f64;
        figures.push(Figure::new(
            format!("DEM: {n} grains, steps over N"),
            expected,
            0.05 * expected,
            steps / *n as f64,
        ));
    }
    figures.push(Figure::new("DEM: exponent", 1.0, 0.05, exponent(&springs)));
    figures
}

/// The smallest number from `low` up that is enough, to 1 %.
fn first_that(mut low: f64, enough: impl Fn(f64) -> bool) -> f64 {
    assert!(!enough(low.floor()), "{low} are enough");
    let mut high = 1.1 * low;
    while !enough(high.floor()) {
        (low, high) = (high, 1.1 * high);
    }
    while high > 1.01 * low && high.floor() > low.floor() + 1.0 {
        let middle = (low * high).sqrt();
        if enough(middle.floor()) { high = middle } else { low = middle }
    }
    high.floor()
}
