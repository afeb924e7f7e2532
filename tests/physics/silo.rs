//! The load on the floor of a silo.

use crate::common::*;
use packstone::scene::Scene;
use std::path::Path;

/// Width of the silo, diameters of a grain.
const WIDTH: f64 = 8.0;
const FRICTION: f64 = 0.5;

/// Mean part of the weight that the floor carries, of disks between two walls, while it gives way slowly: so walls carry all that
/// their friction lets them. Height of the disks over the width of the silo, if they filled 0.82 of it.
fn carried(count: usize) -> (f64, f64) {
    let wall = |name: &str, x: f64, normal: &str, velocity: f64| {
        format!(
            "[[wall]]\nkind = \"plane\"\nname = \"{name}\"\nmaterial = \"sand\"\npoint = [{x}, 0]\nnormal = {normal}\n\
             velocity = [0, {velocity}]\n"
        )
    };
    let text = format!(
        "dimension = 2\n[material.sand]\ndensity = 2500\nnormal_stiffness = 5e4\nfriction = {FRICTION}\nrestitution = 0.2\n{}{}{}\
         [[population]]\nmaterial = \"sand\"\ncount = {count}\nradius = {{ uniform = [0.9e-3, 1.1e-3] }}\n\
         [solver]\ndt = 1.6e-5\ndamping = 5\n[stop]\ntime = 0.5\n",
        wall("floor", 0.0, "[0, 1]", -0.01),
        wall("left", 0.0, "[1, 0]", 0.0),
        wall("right", WIDTH * 2e-3, "[-1, 0]", 0.0),
    );
    let scene = Scene::parse(&text, "silo", Path::new("."), &[]).unwrap().assemble().unwrap();
    let areas: f64 = scene.grains.iter().map(|grain| std::f64::consts::PI * grain.radius.powi(2)).sum();
    let mut simulation = CPU.start(&scene);
    simulation.advance(12_500).unwrap();
    // The load goes up and down by a quarter as grains slip.
    let loads = (0..100).map(|_| {
        simulation.advance(312).unwrap();
        simulation.wall_loads().unwrap()[0].normal_force
    });
    let load = loads.sum::<f64>() / 100.0;
    (load / (2500.0 * areas * G), areas / (0.82 * (WIDTH * 2e-3).powi(2)))
}

/// Janssen (1895): under a height H the floor of a silo of width D carries (1 - exp(-H/L)) L/H of the weight, L = D/(2 μ K), with
/// the ratio K of lateral to vertical stress. A bed twice as high, of twice the weight, loads the floor by less than half more, and
/// one K fits both.
#[test]
fn a_silo_carries_its_filling() {
    let [(low, height), (high, twice)] = [200, 400].map(carried);
    let janssen = |height: f64, length: f64| length / height * (1.0 - (-height / length).exp());
    // L of the higher bed: it grows with what is carried.
    let (mut least, mut most) = (1e-3, 1e3);
    for _ in 0..60 {
        let length = 0.5 * (least + most);
        *(if janssen(twice, length) < high { &mut least } else { &mut most }) = length;
    }
    let (expected, ratio) = (janssen(height, least), 1.0 / (2.0 * FRICTION * least));
    println!("{low:.3} and {high:.3} of the weight, Janssen {expected:.3} with K = {ratio:.2}");
    assert!(2.0 * high < 1.5 * low, "{low} {high}");
    assert!((low / expected - 1.0).abs() < 0.15, "{low}, Janssen {expected}");
    assert!((0.4..0.8).contains(&ratio), "K = {ratio}");
}
