//! What must not change: conserved quantities, symmetries, and results under everything that is only bookkeeping.

#[path = "../common/mod.rs"]
mod common;

mod alike;
mod conserved;
mod ends;
mod lists;
mod seam;
mod symmetries;

use common::*;
use packstone::scene::{Assembly, Dashpot, Grain};

/// Overlaps of about 2 % of R.
fn speed(dimension: usize) -> f64 {
    0.02 * R * (KN / mass(dimension, R)).sqrt()
}

/// 1/50 of a contact of two default grains.
fn dt(dimension: usize) -> f64 {
    std::f64::consts::PI / (2.0 * KN / mass(dimension, R)).sqrt() / 50.0
}

/// A dense frictional cloud in open space, in two materials.
fn gas(dimension: usize, side: usize, friction: f64, dashpot: Dashpot) -> Assembly {
    let mut scene = blank_dt(dimension, dt(dimension));
    scene.grains = cloud(dimension, side, speed(dimension), 3);
    let first = packstone::scene::Pair { dashpot, ..law(friction) };
    set_laws(&mut scene, &[first, packstone::scene::Pair { normal_stiffness: 0.6 * KN, ..first }]);
    scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.material = (k % 2) as u32);
    scene
}

fn periodic(mut scene: Assembly, side: usize) -> Assembly {
    for axis in 0..scene.dimension {
        (scene.domain.lower[axis], scene.domain.upper[axis]) = (0.0, SPACING * side as f64);
        scene.domain.periodic[axis] = true;
    }
    scene
}

/// A dense frictional periodic gas that is fast enough to need new lists every few steps.
fn violent(dimension: usize) -> (Assembly, u64) {
    let side = if dimension == 2 { 10 } else { 5 };
    let mut scene = periodic(gas(dimension, side, 0.6, Dashpot::Restitution(0.9)), side);
    scene.grains.iter_mut().for_each(|g| g.velocity *= 2.0);
    (scene, 400)
}

/// Everything that a run ends with, bit by bit.
fn bits(grains: &[Grain]) -> Vec<[u64; 9]> {
    let of = |g: &Grain| {
        let mut all = [0; 9];
        let parts = [g.position, g.velocity, g.spin].into_iter().flat_map(|v| v.to_array());
        all.iter_mut().zip(parts).for_each(|(bits, x)| *bits = x.to_bits());
        all
    };
    grains.iter().map(of).collect()
}
