//! Flight: gravity and global damping.

use crate::{common::*, shared::*};
use glam::DVec3;

/// Constant acceleration is exact for leapfrog started with a half kick (N1). f32: 400 additions of half an ulp of
/// 16 mm on a path of 4 mm are 3e-5 at worst.
#[test]
fn free_fall() {
    let mut scene = blank_dt(3, 5e-5);
    scene.solver.allow_unstable = true; // nothing touches
    scene.gravity = DVec3::new(1.0, -2.0, -G);
    scene.grains = (0..3).map(|k| grain(5.0 * R * f64::from(k), 0.0, 0.0)).collect();
    scene.grains[1].velocity = DVec3::new(0.1, 0.2, 0.3);
    scene.grains[2].velocity = DVec3::new(0.0, -0.3, 0.1);
    scene.grains[2].spin = DVec3::new(100.0, 20.0, -3.0);
    let t = 400.0 * 5e-5;
    for (bench, variant) in engines().into_iter().flat_map(|bench| variants(3).into_iter().map(move |v| (bench, v))) {
        // f64: so many more roundings, of numbers so much larger.
        let rounding = 1e-13 * variant.finer as f64 * (1.0 + variant.velocity.length() / 0.1);
        for (g, g0) in variant.after(&bench, &scene, 400).iter().zip(&scene.grains) {
            let path = g0.velocity * t + 0.5 * t * t * scene.gravity;
            let v = g0.velocity + t * scene.gravity;
            let error = (g.position - g0.position - path).length();
            let what = format!("{} {variant:?}", bench.name);
            close(&what, error, 0.0, path.length(), bench.pick(rounding, 3e-5));
            close(&what, (g.velocity - v).length(), 0.0, v.length(), bench.pick(rounding, 1e-5));
            assert_eq!(g.spin, if bench.is_single() { g0.spin.as_vec3().as_dvec3() } else { g0.spin });
        }
    }
}

/// Global damping in free flight (N2): the centred discrete solution to rounding, terminal speed g/ξ, and order 2
/// against the continuous one.
#[test]
fn damped_flight() {
    let (xi, v0, end) = (40.0, 0.1, 0.05);
    let scene = |steps: u64| {
        let mut scene = blank_dt(3, end / steps as f64);
        scene.solver.allow_unstable = true; // nothing touches
        scene.solver.margin = 1.0;
        scene.solver.damping = xi;
        scene.gravity = DVec3::new(0.0, 0.0, -G);
        scene.grains = vec![grain(0.0, 0.0, 0.0)];
        scene.grains[0].velocity = DVec3::X * v0;
        scene.grains[0].spin = DVec3::X * 5.0;
        scene
    };
    for bench in engines() {
        let steps = 200;
        let h = 0.5 * xi * end / steps as f64;
        let g = bench.after(&scene(steps), steps)[0];
        // v(n+1/2) = v∞ + (v(1/2) - v∞) rⁿ and x is its sum; v(1/2) is half an explicit kick from v(0).
        let ratio = (1.0 - h) / (1.0 + h);
        let discrete = |v0: f64, limit: f64| {
            let first = v0 + h * (limit - v0);
            let sum = (1.0 - ratio.powi(steps as i32)) / (1.0 - ratio);
            (end * limit + end / steps as f64 * (first - limit) * sum, limit + (v0 - limit) * ratio.powi(steps as i32))
        };
        let tolerance = bench.pick(1e-13, 3e-5);
        let ((x, vx), (z, vz)) = (discrete(v0, 0.0), discrete(0.0, -G / xi));
        close("x", g.position.x, x, x.abs(), tolerance);
        close("z", g.position.z, z, z.abs(), tolerance);
        close("vx", g.velocity.x, vx, v0, tolerance);
        close("vz", g.velocity.z, vz, G / xi, tolerance);
        close("spin", g.spin.x, 5.0 * vx / v0, 5.0, tolerance);
    }
    let error =
        |steps: u64| (CPU.after(&scene(steps), steps)[0].position.x - v0 / xi * (1.0 - (-xi * end).exp())).abs();
    let order = (error(50) / error(100)).log2();
    println!("damped flight: order {order:.4}");
    close("order", order, 2.0, 1.0, 0.05);
}
