//! Radii that change: closed forms of what contacts see of it, digits, and energy.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::{
    scene::{Assembly, Dashpot, Grain, Growth, Hertz, Pair, Rolling},
    state::array::{ID, POSITION, POSITION_LOW},
};
use std::f64::consts::PI;

/// Radii that change at this rate and never end in a test.
fn growing(rate: f64) -> Growth {
    Growth { rate, end: Some(if rate < 0.0 { 0.5 } else { 2.0 }), ..Growth::default() }
}

/// A fixed grain that grows hits one at rest as if it came at the speed of its surface: the overlap is that of an impact, by
/// the spring and by the dashpot.
#[test]
fn a_grain_that_grows_hits_another() {
    for (dimension, restitution) in [(2, 1.0), (3, 1.0), (2, 0.5), (3, 0.5)] {
        for bench in engines() {
            let mass = mass(dimension, R);
            let zeta = -f64::ln(restitution) / PI.hypot(f64::ln(restitution));
            let omega = (KN / mass).sqrt();
            let (decay, frequency) = (zeta * omega, omega * (1.0 - zeta * zeta).sqrt());
            let speed = 1e-4 * R * omega;
            let steps = 2000;
            let mut scene = blank_dt(dimension, PI / frequency / f64::from(steps));
            set_laws(&mut scene, &[law(0.0); 2]);
            if restitution < 1.0 {
                scene.pairs.iter_mut().for_each(|pair| pair.dashpot = Dashpot::Restitution(restitution));
            }
            scene.growth = vec![Growth::default(), growing(speed / R)];
            scene.grains = vec![Grain { material: 1, fixed: true, ..grain(0.0, 0.0, 0.0) }, grain(2.0 * R, 0.0, 0.0)];
            let mut simulation = bench.start(&scene);
            for _ in 0..3 {
                simulation.advance(600).unwrap();
                let t = simulation.time();
                let grains = simulation.grains().unwrap();
                close("radius", grains[0].radius, R + speed * t, R, 1e-15);
                let overlap = grains[0].radius + R - grains[1].position.distance(grains[0].position);
                let expected = speed / frequency * (-decay * t).exp() * (frequency * t).sin();
                let what = format!("{} {dimension}d, e = {restitution}: overlap", bench.name);
                close(&what, overlap, expected, speed / omega, bench.pick(2e-3, 2e-3));
                let force = simulation.forces().unwrap()[1].0.x;
                let approach =
                    speed * (-decay * t).exp() * ((frequency * t).cos() - decay / frequency * (frequency * t).sin());
                let expected = KN * expected + 2.0 * zeta * omega * mass * approach;
                close("force", force, expected, KN * speed / omega, 3e-3);
            }
            simulation.advance(400).unwrap();
            let away = simulation.grains().unwrap()[1].velocity.x;
            close("rebound", away, (1.0 + restitution) * speed, speed, 3e-3);
        }
    }
}

/// A grain that grows between two walls presses on both alike: by its spring, and by its dashpot with the mass that it has by
/// then.
#[test]
fn a_grain_that_grows_between_walls() {
    for dimension in [2, 3] {
        for bench in engines() {
            let rate = 0.5;
            let mut scene = blank_dt(dimension, 1e-6);
            scene.pairs[0].dashpot = Dashpot::Restitution(0.3);
            scene.walls = vec![plane(-R * DVec3::X, DVec3::X), plane(R * DVec3::X, -DVec3::X)];
            scene.growth = vec![growing(rate)];
            scene.grains = vec![grain(0.0, 0.0, 0.0)];
            let mut simulation = bench.start(&scene);
            simulation.advance(4000).unwrap();
            let factor = 1.0 + rate * simulation.time();
            let zeta = -f64::ln(0.3) / PI.hypot(f64::ln(0.3));
            let mass = mass(dimension, R) * factor.powi(dimension as i32);
            let expected = KN * R * (factor - 1.0) + 2.0 * zeta * (KN * mass).sqrt() * R * rate;
            for load in simulation.wall_loads().unwrap() {
                close(
                    &format!("{} {dimension}d", bench.name),
                    load.normal_force,
                    expected,
                    expected,
                    bench.pick(1e-9, 1e-6),
                );
            }
            assert!(simulation.grains().unwrap()[0].position.length() < 1e-9 * R);
        }
    }
}

/// After thousands of steps radii have all their digits, in single precision as well, and are in the same proportion.
#[test]
fn radii_keep_their_digits() {
    for bench in engines() {
        let mut scene = blank_dt(3, 1e-6);
        set_laws(&mut scene, &[law(0.0); 3]);
        scene.growth = vec![growing(3.7), growing(-2.9), Growth::default()];
        let radius = |k: usize| R * (0.3 + 0.0123456789 * k as f64);
        scene.grains = (0..60)
            .map(|k| Grain { radius: radius(k), material: (k % 3) as u32, ..grain(4.0 * R * k as f64, 0.0, 0.0) })
            .collect();
        let mut simulation = bench.start(&scene);
        for _ in 0..4 {
            simulation.advance(777).unwrap();
            let t = simulation.time();
            let expected = |k: usize| radius(k) * [1.0 + 3.7 * t, 1.0 - 2.9 * t, 1.0][k % 3];
            let single = bench.is_single();
            let arrays: &[_] = if single { &[&ID, &POSITION, &POSITION_LOW] } else { &[&ID, &POSITION] };
            let s = simulation.read(arrays).unwrap();
            for (i, id) in s.id.iter().enumerate() {
                let (whole, low) = (s.position[i].radius, s.position_low.get(i).map_or(0.0, |low| low.radius));
                let expected = expected(*id as usize);
                close(bench.name, whole + low, expected, expected, bench.pick(1e-15, 3e-11));
                close(bench.name, whole, expected, expected, bench.pick(1e-15, 6e-8));
            }
        }
    }
}

/// Grains of two materials, one of which grows, in a box with gravity, friction, rolling resistance and dashpots: what there
/// is and what was dissipated is what there was and what growth has done, also on masses.
#[test]
fn growth_does_work() {
    for (dimension, hertz, single) in [(2, false, false), (3, false, false), (3, true, false), (3, false, true)] {
        for bench in engines() {
            let omega = omega(dimension);
            let mut scene = blank_dt(dimension, PI / (2.0_f64.sqrt() * omega) / 200.0);
            let rolling = Some(Rolling { friction: 0.1, stiffness: 0.3, damping: 0.2 });
            let hertz = hertz.then(|| Hertz::of_material(2e8, 0.3));
            let pair = Pair { dashpot: Dashpot::Restitution(0.5), rolling, hertz, ..law(0.3) };
            set_laws(&mut scene, &[pair; 2]);
            let edge = 2.5 * R;
            let normals = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
            scene.walls = normals[..2 * dimension].iter().map(|n| plane(-*n * edge, *n)).collect();
            scene.gravity = -omega.powi(2) * 1e-4 * R * DVec3::Y;
            let mut random = Random(3);
            let speed = 3e-3 * R * omega;
            scene.grains = (0..9)
                .map(|k| Grain {
                    velocity: speed * random.vector(dimension),
                    radius: 0.75 * R,
                    material: u32::from(!single && k % 2 == 1),
                    fixed: k == 4,
                    ..grain(((k % 3) as f64 - 1.0) * 1.6 * R, ((k / 3) as f64 - 1.0) * 1.6 * R, 0.0)
                })
                .collect();
            let rate = if single { 2e-3 } else { 3.3e-3 } * omega;
            scene.growth = vec![growing(rate), growing(if single { rate } else { -0.1 * rate })];
            scene.output.works = true;
            balanced(&bench, &scene);
        }
    }
}

/// Whether every row balances.
fn balanced(bench: &Bench, scene: &Assembly) {
    let mut simulation = bench.start(scene);
    let begun = simulation.sample().unwrap();
    let energy = |s: &packstone::measure::Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
    let (mut worst, mut ends) = (0.0_f64, [0.0; 2]);
    while simulation.step() < 6000 {
        simulation.advance(37).unwrap();
        let row = simulation.sample().unwrap();
        let work = row.growth.unwrap().work_growth.unwrap();
        ends = [work, row.dissipated.unwrap()];
        let lost = energy(&row) + ends[1] - energy(&begun) - work - row.work_walls.unwrap() - row.work_fixed.unwrap();
        worst = worst.max(lost.abs());
    }
    let scale = ends[0].max(ends[1]);
    let what = format!("{} {}d", bench.name, scene.dimension);
    println!("{what}: off by {:.1e} of {:.2e} J of growth, {:.2e} J dissipated", worst / scale, ends[0], ends[1]);
    assert!(ends[0] > 0.1 * ends[1] && ends[1] > 0.01 * ends[0], "{what}: {ends:?}");
    // Of elastic spheres springs change with the effective radius, too, which is left out.
    let tolerance = if scene.pairs[0].hertz.is_some() { 5e-4 } else { 2e-4 };
    assert!(worst < tolerance * scale, "{what}: {worst:e} of {ends:?}");
}
