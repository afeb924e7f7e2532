//! Order of the scheme.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Assembly, Grain, TimeStep};
use std::f64::consts::TAU;

/// Observed order from three time steps: log₂ of the ratio of the differences.
fn order(scene: &Assembly, end: f64, coarsest: u64) -> f64 {
    let at = |steps: u64| {
        let mut scene = scene.clone();
        scene.solver.dt = TimeStep::Fixed(end / steps as f64);
        scene.solver.allow_unstable = true;
        CPU.after(&scene, steps)
    };
    let (a, b, c) = (at(coarsest), at(2 * coarsest), at(4 * coarsest));
    (distance(scene, &a, &b) / distance(scene, &b, &c)).log2()
}

/// Second order wherever no contact opens, closes or slides.
#[test]
fn second_order() {
    let w = omega(3);
    // An overlapping pair of unequal spheres swings open.
    let mut pair = blank(3);
    pair.grains = vec![grain(0.0, 0.0, 0.0), Grain { radius: 0.7 * R, ..grain(1.0 * R, 1.3 * R, 0.2 * R) }];
    // A damped grain bobs on the floor.
    let mut bobbing = blank(3);
    bobbing.walls = vec![floor(3)];
    bobbing.grains = vec![grain(0.0, 0.0, 0.98 * R)];
    bobbing.grains[0].velocity.z = 0.005 * R * w;
    bobbing.gravity = -0.02 * R * w * w * DVec3::Z;
    bobbing.solver.damping = 0.3 * w;
    // A grain that sticks to the floor swings on its tangential spring.
    let mut sticking = bobbing.clone();
    sticking.solver.damping = 0.0;
    sticking.pairs = vec![law(100.0)];
    sticking.grains[0].velocity.x = 0.005 * R * w;
    sticking.grains[0].spin = DVec3::new(0.001, 0.002, 0.003) * w;
    // Three grains in a ring, pressed together and turning about each other.
    let mut ring = blank(3);
    for k in 0..3 {
        let direction = DVec3::new((TAU * f64::from(k) / 3.0).cos(), (TAU * f64::from(k) / 3.0).sin(), 0.0);
        let mut g = grain(0.0, 0.0, 0.0);
        g.position = 1.1 * R * direction;
        g.velocity = 0.05 * w * DVec3::new(0.1, 0.2, 1.0).cross(g.position);
        ring.grains.push(g);
    }
    let cases = [("pair", pair, 1.0), ("bobbing", bobbing, 3.0), ("sticking", sticking, 3.0), ("ring", ring, 0.8)];
    for (name, scene, end) in cases {
        let order = order(&scene, end / w, 40);
        println!("order of {name}: {order:.3}");
        assert!(order >= 1.9, "order of {name}: {order}");
    }
}
