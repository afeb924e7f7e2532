//! Elastic spheres: Hertz' normal force, Mindlin's tangential force, Tsuji's dashpot.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::{
    prelude::*,
    scene::{Dashpot, Grain, Hertz, Pair},
};

const E: f64 = 1e8;
const NU: f64 = 0.25;

/// A material of this Young's modulus and Poisson's ratio against itself.
fn elastic(youngs_modulus: f64, poissons_ratio: f64, friction: f64, dashpot: Dashpot) -> Pair {
    let hertz = Some(Hertz::of_material(youngs_modulus, poissons_ratio));
    Pair { normal_stiffness: 0.0, tangential_stiffness: 0.0, friction, dashpot, hertz, rolling: None }
}

/// A sphere of radius r that flies against a floor at speed v, ready to touch after some steps.
fn thrown(pair: Pair, r: f64, v: DVec3, dt: f64) -> Assembly {
    let mut scene = blank_dt(3, dt);
    scene.pairs = vec![pair];
    scene.walls = vec![floor(3)];
    scene.solver.allow_unstable = true;
    scene.grains =
        vec![Grain { position: DVec3::Z * (r - 2.5 * dt * v.z), velocity: v, radius: r, ..grain(0.0, 0.0, 0.0) }];
    scene
}

/// δ_max = (15 m* v² / (16 E* √R*))^(2/5), t_c = 2.9432 δ_max / v (Johnson 1985, eq. 11.22 to 11.24), on a wall and between two spheres.
#[test]
fn collision_time_and_overlap() {
    for bench in engines() {
        for pair_of_spheres in [false, true] {
            let m = mass(3, R);
            let (m_eff, r_eff) = if pair_of_spheres { (m / 2.0, R / 2.0) } else { (m, R) };
            let modulus = Hertz::of_material(E, NU).youngs_modulus;
            let v = 0.05;
            let depth = (15.0 * m_eff * v * v / (16.0 * modulus * r_eff.sqrt())).powf(0.4);
            let duration = 2.943_275 * depth / v;
            let dt = duration / 400.0;
            let pair = elastic(E, NU, 0.0, Dashpot::None);
            let mut scene = thrown(pair, R, -v * DVec3::Z, dt);
            if pair_of_spheres {
                scene.walls.clear();
                scene.grains[0].position.z += R;
                scene.grains.insert(0, grain(0.0, 0.0, 0.0));
            }
            let mut simulation = bench.start(&scene);
            let (mut deepest, mut last, mut end) = (0.0_f64, f64::INFINITY, None);
            for step in 1..450 {
                simulation.advance(1).unwrap();
                let grains = simulation.grains().unwrap();
                let gap = match &grains[..] {
                    [a, b] => (b.position - a.position).length() - 2.0 * R,
                    [a] => a.position.z - R,
                    _ => unreachable!(),
                };
                deepest = deepest.max(-gap);
                if last < 0.0 && gap >= 0.0 && end.is_none() {
                    end = Some(f64::from(step) - gap / (gap - last));
                }
                last = gap;
            }
            let what = format!("{} pair {pair_of_spheres}", bench.name);
            close(&format!("{what}: overlap"), deepest, depth, depth, 1e-3);
            close(&format!("{what}: duration"), (end.expect("they part") - 2.5) * dt, duration, duration, 2e-3);
        }
    }
}

/// With its dashpot a sphere rebounds with the restitution that was asked for, at any speed.
#[test]
fn restitution_at_any_speed() {
    for e in [0.9, 0.5, 0.2] {
        for v in [0.01, 0.1, 1.0] {
            let m = mass(3, R);
            let depth = (15.0 * m * v * v / (16.0 * Hertz::of_material(E, NU).youngs_modulus * R.sqrt())).powf(0.4);
            let dt = depth / v / 2000.0;
            let scene = thrown(elastic(E, NU, 0.0, Dashpot::Restitution(e)), R, -v * DVec3::Z, dt);
            let out = CPU.after(&scene, 20_000)[0].velocity.z / v;
            close(&format!("e = {e} at {v} m/s"), out, e, 1.0, 4e-3);
        }
    }
}

/// A sphere held between moving walls is sheared to and fro while it is loaded and unloaded: no cycle gives back more than was put in.
#[test]
fn no_cycle_creates_energy() {
    for bench in engines() {
        // Pressed by gravity along z, swinging, and pulled sideways by a spring of its own: the floor tilts.
        let mut scene = blank_dt(3, 2e-6);
        scene.pairs = vec![elastic(1e7, 0.3, 2.0, Dashpot::None)];
        scene.walls = vec![floor(3)];
        scene.gravity = DVec3::new(2.0, 1.0, -9.81);
        scene.grains = vec![Grain { velocity: DVec3::new(0.02, 0.0, -0.05), ..grain(0.0, 0.0, 0.999 * R) }];
        let mut simulation = bench.start(&scene);
        let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let first = simulation.sample().unwrap();
        let scale = first.kinetic_energy + mass(3, R) * G * R;
        let mut highest = f64::NEG_INFINITY;
        for _ in 0..200 {
            simulation.advance(100).unwrap();
            highest = highest.max(energy(&simulation.sample().unwrap()) - energy(&first));
        }
        assert!(highest < bench.pick(2e-4, 3e-4) * scale, "{}: {highest:e} of {scale:e} J created", bench.name);
    }
}

/// Rows of a file in tests/data/chung_ooi, table by table.
fn curves(text: &str) -> Vec<Vec<Vec<f64>>> {
    let mut tables: Vec<Vec<Vec<f64>>> = vec![vec![]];
    for line in text.lines() {
        if line.starts_with('#') {
            if !tables.last().unwrap().is_empty() {
                tables.push(vec![]);
            }
        } else {
            tables.last_mut().unwrap().push(line.split(',').map(|x| x.parse().unwrap()).collect());
        }
    }
    tables
}

/// Chung & Ooi test 4: an aluminium oxide sphere hits a wall at 3.9 m/s under all angles.
#[test]
fn chung_ooi_4() {
    let (r, v) = (2.5e-3, 3.9);
    for row in &curves(include_str!("../data/chung_ooi/test4_al_oxide.csv"))[0] {
        let [angle, et, spin, _] = row[..] else { panic!("four columns") };
        let (s, c) = angle.to_radians().sin_cos();
        let pair = elastic(3.8e11, 0.23, 0.092, Dashpot::Restitution(0.98));
        let mut scene = thrown(pair, r, v * DVec3::new(s, 0.0, -c), 2e-8);
        scene.materials[0].density = 4000.0;
        let g = CPU.after(&scene, 3000)[0];
        assert!(g.velocity.z > 0.0);
        close(&format!("{angle} degrees: e_t"), g.velocity.x / (v * s), et, 1.0, 0.02);
        close(&format!("{angle} degrees: spin"), -g.spin.y.abs(), spin, 620.0, 0.03);
    }
}

/// Chung & Ooi test 5: steel, constant normal speed, without loss.
#[test]
fn chung_ooi_5() {
    let (r, vn, mu) = (1e-5, 5.0, 0.3);
    let tables = curves(include_str!("../data/chung_ooi/test5_steel.csv"));
    let out = |psi: f64| {
        let pair = elastic(2.08e11, 0.3, mu, Dashpot::None);
        let mut scene = thrown(pair, r, DVec3::new(psi * mu * vn, 0.0, -vn), 2e-11);
        scene.materials[0].density = 7850.0;
        let g = CPU.after(&scene, 8000)[0];
        assert!(g.velocity.z > 0.99 * vn, "{psi}: {}", g.velocity.z);
        let slip = g.velocity.x - g.spin.y * r;
        (slip / (mu * g.velocity.z), -(g.spin.y * r).abs() / (mu * vn))
    };
    for row in &tables[0] {
        close(&format!("psi2 at {}", row[0]), out(row[0]).0, row[1], 1.0, 0.12);
    }
    for row in &tables[1] {
        close(&format!("spin at {}", row[0]), out(row[0]).1, row[1], 1.0, 0.12);
    }
}

/// Chung & Ooi test 6: an aluminium alloy sphere that spins falls on a wall.
#[test]
fn chung_ooi_6() {
    let (r, vn, mu, e) = (0.1, 0.2, 0.4, 0.5);
    for row in &curves(include_str!("../data/chung_ooi/test6_al_alloy.csv"))[0] {
        let surface = 3.5 * mu * (1.0 + e) * vn / row[0];
        let pair = elastic(7e10, 0.33, mu, Dashpot::Restitution(e));
        let mut scene = thrown(pair, r, -vn * DVec3::Z, 1e-6);
        scene.materials[0].density = 2700.0;
        scene.grains[0].spin.y = surface / r;
        let g = CPU.after(&scene, 2500)[0];
        assert!(g.velocity.z > 0.0);
        let slip = g.velocity.x - g.spin.y * r;
        close(&format!("beta at {}", row[0]), slip / surface * 1.0, row[1], 1.0, 0.06);
    }
}

/// A scene of the file format: keys, the automatic time step below its bound, energy kept by the step that it gives.
#[test]
fn automatic_step() {
    let steel = MaterialBuilder::new(2500.0).youngs_modulus(1e7).poissons_ratio(0.3).friction(0.5);
    let scene = Scene::builder(3)
        .material("steel", steel)
        .wall(WallBuilder::plane("steel", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]))
        .grain(GrainBuilder::new("steel", [0.0, 0.0, 0.02], 1e-3))
        .stop_time(0.5)
        .assemble()
        .unwrap();
    let mut simulation = CPU.start(&scene);
    assert!(simulation.dt() < simulation.dt_bound() && simulation.dt_bound().is_finite());
    let start = simulation.sample().unwrap().potential_energy;
    simulation.advance((0.5 / simulation.dt()) as u64).unwrap();
    let s = simulation.sample().unwrap();
    close("energy", s.kinetic_energy + s.potential_energy + s.elastic_energy, start, start, 2e-3);
}
