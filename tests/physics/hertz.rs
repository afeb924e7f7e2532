//! Elastic spheres: Hertz' normal force, Mindlin's tangential force, Tsuji's dashpot.

use crate::{common::*, shared::frames};
use glam::DVec3;
use packstone::{
    prelude::*,
    scene::{Dashpot, Grain, Hertz, Pair},
};
use std::f64::consts::PI;

const E: f64 = 1e8;
const NU: f64 = 0.25;

/// A material of this Young's modulus and Poisson's ratio against itself.
fn elastic(youngs_modulus: f64, poissons_ratio: f64, friction: f64, dashpot: Dashpot) -> Pair {
    let hertz = Some(Hertz::of_material(youngs_modulus, poissons_ratio));
    Pair { friction, dashpot, hertz, ..Pair::default() }
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

/// δ_max = (15 m* v² / (16 E* √R*))^(2/5), t_c = 2.9432 δ_max / v (Johnson 1985, eq. 11.22 to 11.24), on a wall and
/// between two spheres.
#[test]
fn collision_time_and_overlap() {
    for bench in engines() {
        for (pair_of_spheres, frame) in [false, true].into_iter().flat_map(|pair| frames(3).map(|frame| (pair, frame)))
        {
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
            let mut simulation = frame.start(&bench, &scene);
            let (mut deepest, mut last, mut end) = (0.0_f64, f64::INFINITY, None);
            for step in 1..450 {
                simulation.advance(1);
                let grains = simulation.grains();
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
            let what = format!("{} {frame:?} pair {pair_of_spheres}", bench.name);
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

/// A sphere bounces on its overlap while gravity rolls and drags it along the floor, both springs loaded and unloaded:
/// energy does not rise, and what it loses is told.
#[test]
fn no_cycle_creates_energy() {
    for bench in engines() {
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

/// An elastic sphere hits a floor at 45 degrees and sticks: what the tangential spring loses as its stiffness changes
/// is told, so that the energies and the dissipation of all steps add up.
#[test]
fn dissipation_adds_up() {
    for bench in engines() {
        let (v, dt) = (0.05, 2e-7);
        let mut scene = thrown(elastic(E, NU, 10.0, Dashpot::None), R, v * DVec3::new(1.0, 0.0, -1.0), dt);
        scene.grains[0].spin.y = 3.0;
        let mut simulation = bench.start(&scene);
        let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let first = simulation.sample().unwrap();
        let (mut lost, mut before) = (0.0, first.dissipation);
        while simulation.grains().unwrap()[0].velocity.z < 0.0 || simulation.sample().unwrap().contacts > 0 {
            simulation.advance(1).unwrap();
            let s = simulation.sample().unwrap();
            lost += 0.5 * (before + s.dissipation) * dt;
            before = s.dissipation;
        }
        let last = simulation.sample().unwrap();
        let kinetic = first.kinetic_energy;
        assert!(lost > 0.01 * kinetic, "{}: there is something to tell, {lost:e} of {kinetic:e} J", bench.name);
        close(bench.name, energy(&last) + lost, energy(&first), kinetic, bench.pick(1e-3, 2e-3));
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

/// How the tangential force follows the stiffness.
#[derive(Clone, Copy)]
enum Rescaled {
    /// Where the stiffness falls, as here.
    Unloading,
    /// Always: F = k_T ξ, as in the code whose curves Chung & Ooi show. It can create energy.
    Always,
}

/// One impact of a sphere on a rigid plane.
#[derive(Clone, Copy)]
struct Impact {
    r: f64,
    density: f64,
    youngs_modulus: f64,
    poissons_ratio: f64,
    friction: f64,
    restitution: f64,
    /// m/s: along the plane, and against it.
    tangential: f64,
    normal: f64,
    /// rad/s, positive where the surface moves along with `tangential`.
    spin: f64,
}

impl Impact {
    /// Velocity along the plane and spin afterwards, by symplectic Euler steps of the three ordinary differential
    /// equations: no code in common with the engines.
    fn integrated(&self, rescaled: Rescaled) -> (f64, f64) {
        let Impact { r, friction, .. } = *self;
        let m = self.density * 4.0 / 3.0 * PI * r.powi(3);
        let nu = self.poissons_ratio;
        let modulus = self.youngs_modulus / (2.0 * (1.0 - nu * nu));
        let shear = self.youngs_modulus / (4.0 * (2.0 - nu) * (1.0 + nu));
        let ln_e = self.restitution.ln();
        let ratio = (5.0_f64 / 6.0).sqrt() * -ln_e / (PI * PI + ln_e * ln_e).sqrt();
        let depth = (15.0 * m * self.normal.powi(2) / (16.0 * modulus * r.sqrt())).powf(0.4);
        let dt = depth / self.normal / 20_000.0;
        let (mut vx, mut vz, mut w) = (self.tangential, self.normal, self.spin);
        let (mut overlap, mut force, mut before) = (0.0, 0.0_f64, 0.0_f64);
        loop {
            overlap += vz * dt;
            if overlap <= 0.0 {
                return (vx, w);
            }
            let a = f64::sqrt(r * overlap);
            let (kn, kt) = (2.0 * modulus * a, 8.0 * shear * a);
            let pressing = 4.0 / 3.0 * modulus * a * overlap + 2.0 * ratio * (m * kn).sqrt() * vz;
            match rescaled {
                Rescaled::Always if before > 0.0 => force *= kt / before,
                Rescaled::Unloading if kt < before => force *= kt / before,
                _ => {}
            }
            let arm = r - 0.5 * overlap; // the contact point is in the middle of the overlap
            force -= kt * (vx + w * arm) * dt;
            let limit = friction * pressing.abs();
            force = force.clamp(-limit, limit);
            before = kt;
            vz -= pressing / m * dt;
            vx += force / m * dt;
            w += arm * force / (0.4 * m * r * r) * dt;
        }
    }

    /// The same by the engine.
    fn simulated(&self) -> (f64, f64) {
        let pair =
            elastic(self.youngs_modulus, self.poissons_ratio, self.friction, Dashpot::Restitution(self.restitution));
        let m = self.density * 4.0 / 3.0 * PI * self.r.powi(3);
        let modulus = pair.hertz.unwrap().youngs_modulus;
        let depth = (15.0 * m * self.normal.powi(2) / (16.0 * modulus * self.r.sqrt())).powf(0.4);
        let dt = depth / self.normal / 1500.0;
        let mut scene = thrown(pair, self.r, DVec3::new(self.tangential, 0.0, -self.normal), dt);
        scene.materials[0].density = self.density;
        scene.grains[0].spin.y = -self.spin; // the lowest point moves along x with -ω_y R
        let g = CPU.after(&scene, 7000)[0];
        assert!(g.position.z > self.r, "it has left the plane");
        (g.velocity.x, -g.spin.y)
    }
}

/// Chung & Ooi test 4: an aluminium oxide sphere hits a plane at 3.9 m/s under all angles. Where it slides all the
/// time, from 30 degrees on, all codes agree; below that the curves are those of F = k_T ξ.
#[test]
fn chung_ooi_4() {
    let (r, v) = (2.5e-3, 3.9);
    for row in &curves(include_str!("../data/chung_ooi/test4_al_oxide.csv"))[0] {
        let [angle, et, spin, _] = row[..] else { panic!("four columns") };
        let (s, c) = angle.to_radians().sin_cos();
        let impact = Impact {
            r,
            density: 4000.0,
            youngs_modulus: 3.8e11,
            poissons_ratio: 0.23,
            friction: 0.092,
            restitution: 0.98,
            tangential: v * s,
            normal: v * c,
            spin: 0.0,
        };
        let (vx, w) = impact.simulated();
        let (exact_vx, exact_w) = impact.integrated(Rescaled::Unloading);
        close(&format!("{angle} degrees: e_t of the equations"), vx, exact_vx, v * s, 3e-3);
        close(&format!("{angle} degrees: spin of the equations"), w, exact_w, 620.0, 3e-3);
        let (theirs_vx, theirs_w) = impact.integrated(Rescaled::Always);
        close(&format!("{angle} degrees: e_t of the curves, by their rule"), theirs_vx / (v * s), et, 1.0, 0.016);
        close(&format!("{angle} degrees: spin of the curves, by their rule"), theirs_w, spin, 620.0, 0.03);
        if angle >= 30.0 {
            close(&format!("{angle} degrees: e_t of the curves"), vx / (v * s), et, 1.0, 0.012);
            close(&format!("{angle} degrees: spin of the curves"), w, spin, 620.0, 0.012);
        }
    }
}

/// Chung & Ooi test 5: steel, constant normal speed, without loss: ψ out is ψ in - 7 and R ω is -5 μ v_n where it
/// slides all the time, which is from ψ = 5.8 on (Maw et al. 1976). Below that the digitised curves are those of half
/// of Mindlin's tangential stiffness (ψ out -2.0 at ψ = 5, where Mindlin's gives -1.44); there the equations themselves
/// decide.
#[test]
fn chung_ooi_5() {
    let (r, vn, mu) = (1e-5, 5.0, 0.3);
    let tables = curves(include_str!("../data/chung_ooi/test5_steel.csv"));
    let impact = |psi: f64| Impact {
        r,
        density: 7850.0,
        youngs_modulus: 2.08e11,
        poissons_ratio: 0.3,
        friction: mu,
        restitution: 1.0,
        tangential: psi * mu * vn,
        normal: vn,
        spin: 0.0,
    };
    let scaled = |(vx, w): (f64, f64)| ((vx + w * r) / (mu * vn), w * r / (mu * vn));
    for psi in tables.iter().flatten().map(|row| row[0]) {
        let (found, exact) = (scaled(impact(psi).simulated()), scaled(impact(psi).integrated(Rescaled::Unloading)));
        close(&format!("psi2 at {psi}"), found.0, exact.0, 5.0, 3e-3);
        close(&format!("spin at {psi}"), found.1, exact.1, 5.0, 3e-3);
    }
    for row in tables[0].iter().filter(|row| row[0] >= 5.8) {
        close(&format!("psi2 of the curve at {}", row[0]), scaled(impact(row[0]).simulated()).0, row[1], 5.0, 0.01);
    }
    for row in tables[1].iter().filter(|row| row[0] >= 5.8) {
        close(&format!("spin of the curve at {}", row[0]), scaled(impact(row[0]).simulated()).1, row[1], 5.0, 0.01);
    }
}

/// Chung & Ooi test 6: an aluminium alloy sphere that spins falls on a plane; β = -v_s'/v_s is -1 + x where it slides
/// all the time.
#[test]
fn chung_ooi_6() {
    let (r, vn, mu, e) = (0.1, 0.2, 0.4, 0.5);
    for row in &curves(include_str!("../data/chung_ooi/test6_al_alloy.csv"))[0] {
        let surface = 3.5 * mu * (1.0 + e) * vn / row[0];
        let impact = Impact {
            r,
            density: 2700.0,
            youngs_modulus: 7e10,
            poissons_ratio: 0.33,
            friction: mu,
            restitution: e,
            tangential: 0.0,
            normal: vn,
            spin: surface / r,
        };
        let beta = |(vx, w): (f64, f64)| -(vx + w * r) / surface;
        let (found, exact) = (beta(impact.simulated()), beta(impact.integrated(Rescaled::Unloading)));
        close(&format!("beta at {}", row[0]), found, exact, 1.0, 6e-3);
        if row[0] < 0.6 {
            close(&format!("beta of the curve at {}", row[0]), found, row[1], 1.0, 0.03);
        }
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
