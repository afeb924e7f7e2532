//! Normal impact: duration, depth, restitution.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Dashpot, Grain, Pair, Scene};
use std::{f64::consts::PI, path::Path};

/// Duration π/ω and depth v/ω of an elastic impact (N3) on a wall and between unequal spheres. The force has a kink at
/// first touch, which like the rest of the error is (ω Δt)² = 1e-3 at tc/100.
#[test]
fn elastic_impact() {
    for bench in engines() {
        for (dimension, partner) in [(3, None), (2, None), (3, Some(0.6 * R)), (2, Some(0.6 * R))] {
            for variant in variants(dimension) {
                elastic(bench, dimension, partner, variant);
            }
        }
    }
}

fn elastic(bench: Bench, dimension: usize, partner: Option<f64>, variant: Variant) {
    let m = mass(dimension, R);
    let reduced = partner.map_or(m, |r| 1.0 / (1.0 / m + 1.0 / mass(dimension, r)));
    let w = (KN / reduced).sqrt();
    let (v, dt) = (1e-2 * R * w, PI / w / 100.0);
    let mut scene = blank_dt(dimension, dt);
    let axis = up(dimension);
    let mut flying = grain(0.0, 0.0, 0.0);
    flying.velocity = -v * axis;
    let rest = match partner {
        None => {
            scene.walls = vec![floor(dimension)];
            R
        }
        Some(r) => {
            scene.grains = vec![Grain { radius: r, ..grain(0.0, 0.0, 0.0) }];
            R + r
        }
    };
    flying.position = axis * (rest + 3.3 * dt * v);
    scene.grains.push(flying);
    let mut simulation = variant.start(&bench, &scene);
    let mut depth: f64 = 0.0;
    let mut last = INF;
    let mut end = None;
    for step in 1..120 {
        simulation.advance(1);
        let grains = simulation.grains();
        let below = if partner.is_some() { grains[0].position } else { DVec3::ZERO };
        let gap = (grains.last().unwrap().position - below).dot(axis) - rest;
        depth = depth.max(-gap);
        if last < 0.0 && gap >= 0.0 {
            end = Some(f64::from(step) - gap / (gap - last));
        }
        last = gap;
    }
    let duration = (end.expect("they separate") - 3.3) * dt;
    let e = simulation.grains();
    let out = e.last().unwrap().velocity - if partner.is_some() { e[0].velocity } else { DVec3::ZERO };
    println!(
        "{} {dimension}D {variant:?}: duration {:.2e}, depth {:.2e}, e - 1 = {:.2e}",
        bench.name,
        duration * w / PI - 1.0,
        depth * w / v - 1.0,
        out.dot(axis) / v - 1.0
    );
    close("duration", duration, PI / w, PI / w, 1e-3);
    close("depth", depth, v / w, v / w, 1e-3);
    close("restitution", out.dot(axis), v, v, 1e-3);
}

/// Mean restitution over 16 phases of the first touch between the steps, unequal spheres, one row per law.
fn restitutions(bench: Bench, laws: &[Dashpot], steps_per_contact: f64, frame: Variant) -> Vec<f64> {
    let r = 0.6 * R;
    let reduced = 1.0 / (1.0 / mass(3, R) + 1.0 / mass(3, r));
    let w = (KN / reduced).sqrt();
    let (v, dt) = (2e-2 * R * w, PI / w / steps_per_contact);
    let mut scene = blank_dt(3, dt);
    let laws: Vec<Pair> = laws.iter().map(|dashpot| Pair { dashpot: *dashpot, ..law(0.0) }).collect();
    set_laws(&mut scene, &laws);
    for material in 0..laws.len() {
        for phase in 0..16 {
            let gap = v * dt * (2.0 + (f64::from(phase) + 0.5) / 16.0);
            let at = DVec3::new(0.0, 3.0 * R * f64::from(phase), 3.0 * R * material as f64);
            let material = material as u32;
            scene.grains.push(Grain { position: at, radius: r, material, ..grain(0.0, 0.0, 0.0) });
            let position = at + DVec3::X * (R + r + gap);
            scene.grains.push(Grain { position, material, velocity: DVec3::NEG_X * v, ..grain(0.0, 0.0, 0.0) });
        }
    }
    let grains = frame.after(&bench, &scene, (1.4 * steps_per_contact) as u64 + 4);
    for pair in grains.chunks(2) {
        assert!(pair[1].position.x - pair[0].position.x > R + r, "still in contact");
    }
    let e: Vec<f64> = grains.chunks(2).map(|p| (p[1].velocity - p[0].velocity).x / v).collect();
    e.chunks(16).map(|e| e.iter().sum::<f64>() / 16.0).collect()
}

/// Restitution from the dashpot slots (N4). The dashpot acts on velocities half a step old: then the discrete
/// contact obeys z² − (2 − γΔt − ω²Δt²) z + (1 − γΔt) = 0, which is first order in Δt around e. Both are checked: the
/// rebound follows the discrete law to (ωΔt)², and that law tends to e.
#[test]
fn restitution_by_dashpot() {
    let reduced = 1.0 / (1.0 / mass(3, R) + 1.0 / mass(3, 0.6 * R));
    let w = (KN / reduced).sqrt();
    let gamma = |e: f64| 2.0 * w * -e.ln() / (PI * PI + e.ln() * e.ln()).sqrt();
    let discrete = |gamma: f64, dt: f64| {
        let damped = 1.0 - gamma * dt;
        let angle = ((1.0 + damped - (w * dt).powi(2)) / 2.0 / damped.sqrt()).acos();
        (0.5 * damped.ln() * PI / angle).exp()
    };
    let wanted = [1.0, 0.9, 0.5, 0.2];
    let by_e: Vec<_> = wanted.iter().map(|e| Dashpot::Restitution(*e)).collect();
    let by_eta: Vec<_> = wanted.iter().map(|e| Dashpot::MassScaled(gamma(*e))).collect();
    for laws in [by_e, by_eta] {
        let runs = engines().into_iter().map(|bench| (bench, 100.0)).chain([(CPU, 1000.0)]);
        for ((bench, resolution), frame) in runs.flat_map(|run| frames(3).map(|frame| (run, frame))) {
            let dt = PI / w / resolution;
            for (e, found) in wanted.iter().zip(restitutions(bench, &laws, resolution, frame)) {
                let expected = discrete(gamma(*e), dt);
                println!(
                    "{} {frame:?} tc/{resolution}: e {e} + {:.1e}, discrete law + {:.1e}",
                    bench.name,
                    found - e,
                    found - expected
                );
                // The last touch falls anywhere in its step, which 16 phases average to γΔt/32.
                let tolerance = (w * dt).powi(2) + gamma(*e) * dt / 32.0;
                close("discrete law", found, expected, 1.0, tolerance);
                close("restitution", found, *e, 1.0, 0.5 * gamma(*e) * dt + tolerance);
            }
        }
    }
}

/// A steel ball of 20 mm falls half a metre on a floor of 100 N/m, all settings at their defaults. It sinks in by 3.6
/// radii and bounces: height and speed later are those of the damped spring in gravity, to the 1 % that the default step
/// owes to the dashpot of half a step ago.
#[test]
fn a_soft_floor_throws_a_ball_back() {
    const SCENE: &str = "dimension = 3\nstop.time = 1\n[material.m]\ndensity = 7800\nnormal_stiffness = 100\n\
                         restitution = 0.5\n[[wall]]\nkind = \"plane\"\nmaterial = \"m\"\npoint = [0, 0, 0]\n\
                         normal = [0, 0, 1]\n[[grain]]\nposition = [0, 0, 0.51]\nradius = 10e-3\nmaterial = \"m\"\n";
    let alone = Scene::parse(SCENE, "ball.toml", Path::new("."), &[]).unwrap().assemble().unwrap();
    // Beside small grains it is a large one, which a workgroup of a device serves.
    let mut among_small = alone.clone();
    let small = (0..4).map(|k| Grain { radius: 1e-3, ..grain(0.1 + 0.01 * f64::from(k), 0.0, 1e-3) });
    among_small.grains.extend(small);
    let m = 7800.0 * 4.0 / 3.0 * PI * 1e-6;
    let (k, ln) = (100.0, 0.5_f64.ln());
    let c = -2.0 * ln * (k * m / (ln * ln + PI.powi(2))).sqrt();
    // Gap and speed from the touch to the parting, by the midpoint rule.
    let (mut t, mut gap, mut v, h) = ((2.0 * 0.5 / G).sqrt(), 0.0_f64, -(2.0 * G * 0.5).sqrt(), 1e-7);
    let (mut lowest, force) = (0.0_f64, |gap: f64, v: f64| (-k * gap - c * v) / m - G);
    while gap <= 0.0 {
        let (middle, middle_v) = (gap + 0.5 * h * v, v + 0.5 * h * force(gap, v));
        (gap, v, t) = (gap + h * middle_v, v + h * force(middle, middle_v), t + h);
        lowest = lowest.min(gap);
    }
    for (bench, scene) in engines().into_iter().flat_map(|bench| [(bench, &alone), (bench, &among_small)]) {
        let mut simulation = bench.start(scene);
        assert_eq!(simulation.model().large_grains, scene.grains.len() > 1);
        let steps = ((t + 0.08) / simulation.dt()) as u64;
        let mut deepest = 0.0_f64;
        while simulation.step() < steps {
            simulation.advance_chunk(steps - simulation.step()).unwrap_or_else(|e| panic!("{}: {e}", bench.name));
            deepest = deepest.min(simulation.grains().unwrap()[0].position.z - 0.01);
        }
        let ball = simulation.grains().unwrap()[0];
        let flown = simulation.time() - t;
        println!("{}: deepest {deepest:.4}, expected {lowest:.4}", bench.name);
        assert!(deepest < 0.9 * lowest && deepest > 1.1 * lowest, "{}: {deepest}, {lowest}", bench.name);
        close(bench.name, ball.velocity.z, v - G * flown, v, 0.02);
        close(bench.name, ball.position.z - 0.01, v * flown - 0.5 * G * flown * flown, v * flown, 0.02);
    }
}
