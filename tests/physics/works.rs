//! Energy since step 0: what there is, and what was dissipated, is what there was, and what walls and fixed grains have
//! done.

use crate::{common::*, shared::*};
use glam::{DQuat, DVec3};
use packstone::{
    measure::Sample,
    scene::{Assembly, Dashpot, Grain, Hertz, Pair, Rolling, Servo, Shape, Target},
};
use std::f64::consts::PI;

/// Samples at time 0 and every so many steps, and at the end.
fn rows(bench: &Bench, scene: &Assembly, steps: u64, every: u64) -> Vec<Sample> {
    let mut scene = scene.clone();
    scene.output.works = true;
    let mut simulation = bench.start(&scene);
    let mut rows = vec![simulation.sample().unwrap()];
    while simulation.step() < steps {
        simulation.advance(every.min(steps - simulation.step())).unwrap();
        rows.push(simulation.sample().unwrap());
    }
    rows
}

fn energy(sample: &Sample) -> f64 {
    sample.kinetic_energy + sample.potential_energy + sample.elastic_energy
}

fn ledger(sample: &Sample) -> [f64; 3] {
    [sample.dissipated, sample.work_walls, sample.work_fixed].map(|sum| sum.expect("works are added up"))
}

/// Which of dissipation, work of walls and work of fixed grains is to be no less than a hundredth of the largest.
type Matters = [bool; 3];

/// Every row balances to 2e-4 of what was dissipated in the end, and how many rows there are changes no sum.
fn balances(bench: &Bench, what: &str, scene: &Assembly, steps: u64, matters: Matters) {
    let rows_of = [7, 1000].map(|every| rows(bench, scene, steps, every));
    let end = ledger(rows_of[0].last().unwrap());
    let largest = end.iter().fold(0.0_f64, |largest, sum| largest.max(sum.abs()));
    let mut worst = 0.0_f64;
    for row in rows_of.iter().flatten() {
        let [dissipated, walls, fixed] = ledger(row);
        let error = energy(row) + dissipated - energy(&rows_of[0][0]) - walls - fixed;
        worst = worst.max(error.abs() / end[0]);
    }
    println!("{} {what}: off by {worst:.1e}, {:.2e} {:.2e} {:.2e} J", bench.name, end[0], end[1], end[2]);
    for (sum, matters) in end.iter().zip(matters) {
        assert!(if matters { sum.abs() > 0.01 * largest } else { *sum == 0.0 }, "{what}: {end:?}");
    }
    assert!(worst < 2e-4, "{} {what}: {worst:e}", bench.name);
    for (a, b) in end.iter().zip(ledger(rows_of[1].last().unwrap())) {
        close("sums of fewer rows", b, *a, largest, bench.pick(1e-10, 1e-5));
    }
}

/// Friction, restitution and rolling resistance.
fn rough(friction: f64) -> Pair {
    let rolling = Some(Rolling { friction: 0.1, stiffness: 0.3, damping: 0.2 });
    Pair { dashpot: Dashpot::Restitution(0.5), rolling, ..law(friction) }
}

/// Step of which an impact takes so many, s.
fn step(dimension: usize, steps: f64) -> f64 {
    PI / (2.0_f64.sqrt() * omega(dimension)) / steps
}

/// Speed that makes overlaps of a hundredth of the radius.
fn speed(dimension: usize) -> f64 {
    1e-2 * R * omega(dimension)
}

/// A handful of grains, by their places in radii, thrown about.
fn handful(dimension: usize) -> Vec<Grain> {
    let mut random = Random(3);
    let at = |k: usize| DVec3::new((k % 3) as f64 - 1.0, (k / 3) as f64 - 1.0, 0.0) * 2.05 * R;
    let thrown = |k: usize| {
        let DVec3 { x, y, z } = at(k);
        Grain { velocity: speed(dimension) * random.vector(dimension), ..grain(x, y, z) }
    };
    (0..9).map(thrown).collect()
}

/// Four walls close around the handful, one of which moves in and along itself.
fn shaken(dimension: usize) -> Assembly {
    let mut scene = blank_dt(dimension, step(dimension, 200.0));
    scene.pairs = vec![rough(0.4)];
    let edge = 3.2 * R;
    let normals = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    scene.walls = normals[..2 * dimension].iter().map(|n| plane(-*n * edge, *n)).collect();
    scene.walls[0].velocity = speed(dimension) * DVec3::new(0.5, 0.5, 0.0);
    scene.walls[3].velocity = speed(dimension) * DVec3::X;
    scene.grains = handful(dimension);
    scene
}

#[test]
fn shaken_box() {
    for bench in engines() {
        for dimension in [2, 3] {
            balances(&bench, "box", &shaken(dimension), 3000, [true, true, false]);
        }
    }
}

#[test]
fn spinning_drum() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = shaken(dimension);
            scene.walls = vec![cylinder(4.2 * R)];
            scene.walls[0].spin = speed(dimension) / R;
            scene.gravity = -omega(dimension).powi(2) * 1e-3 * R * DVec3::Y;
            scene.solver.damping = 0.002 * omega(dimension);
            balances(&bench, "drum", &scene, 3000, [true, true, false]);
        }
    }
}

/// A plane that a servo moves, and a tube that one closes.
#[test]
fn servos() {
    for bench in engines() {
        for dimension in [2, 3] {
            let force = 0.02 * KN * speed(dimension) / omega(dimension);
            let servo = |target, area| {
                Some(Servo { target, area, gain: 1e-3, max_speed: 0.2 * speed(dimension), inertial_number: None })
            };
            let mut scene = shaken(dimension);
            scene.walls[0].velocity = DVec3::ZERO;
            scene.walls[0].servo = servo(Target::Force(force), None);
            balances(&bench, "piston", &scene, 3000, [true, true, false]);
            scene.walls = vec![cylinder(4.2 * R)];
            scene.walls[0].servo = servo(Target::Pressure(force / R), Some(R));
            balances(&bench, "tube", &scene, 3000, [true, true, false]);
        }
    }
}

/// Two grains collide, past each other; the other one flies too, or is fixed and moves and spins.
#[test]
fn oblique_impacts() {
    for bench in engines() {
        for dimension in [2, 3] {
            for fixed in [false, true] {
                for hertz in [false, true] {
                    if hertz && dimension == 2 {
                        continue; // disks have no such contact
                    }
                    let v = speed(dimension);
                    let elastic = Pair { hertz: Some(Hertz::of_material(1e8, 0.3)), ..rough(0.3) };
                    let elastic = Pair { normal_stiffness: 0.0, tangential_stiffness: 0.0, ..elastic };
                    let mut scene = blank_dt(dimension, step(dimension, 400.0));
                    scene.pairs = vec![if hertz { elastic } else { rough(0.3) }];
                    let velocity = v * DVec3::new(1.0, 0.6, 0.0);
                    let there = Grain {
                        velocity: -0.5 * velocity,
                        spin: DVec3::Z * v / R,
                        fixed,
                        ..grain(2.003 * R, 0.1 * R, 0.0)
                    };
                    scene.grains = vec![Grain { velocity, ..grain(0.0, 0.0, 0.0) }, there];
                    balances(&bench, if hertz { "hertz" } else { "impact" }, &scene, 1500, [true, false, fixed]);
                }
            }
        }
    }
}

/// Grains that stick, however strong the pull, part with a stretched spring.
#[test]
fn opening() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = blank_dt(dimension, step(dimension, 400.0));
            scene.pairs = vec![Pair { tangential_stiffness: 0.6 * KN, ..law(1e3) }];
            let velocity = speed(dimension) * DVec3::new(1.0, 1.0, 0.0);
            scene.grains = vec![Grain { velocity, ..grain(0.0, 0.0, 0.0) }, grain(2.0 * R, 0.0, 0.0)];
            scene.grains[1].position.x += 0.3 * step(dimension, 400.0) * velocity.x;
            balances(&bench, "opening", &scene, 500, [true, false, false]);
        }
    }
}

/// A grain slides on a belt until it is carried along.
#[test]
fn sliding_on_a_belt() {
    for bench in engines() {
        for dimension in [2, 3] {
            let dt = PI / stick_frequency(dimension) / 32.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, 0.3)];
            scene.gravity = -G * up(dimension);
            scene.walls = vec![floor(dimension)];
            scene.walls[0].velocity = 0.05 * DVec3::X;
            let DVec3 { x, y, z } = up(dimension) * R * (1.0 - 1e-4);
            scene.grains = vec![grain(x, y, z)];
            balances(&bench, "belt", &scene, (0.02 / (0.3 * G) / dt) as u64, [true, true, false]);
        }
    }
}

/// Dimers in the shaken box, one of which is fixed and moves.
#[test]
fn clumps() {
    for bench in engines() {
        for dimension in [2, 3] {
            let mut scene = shaken(dimension);
            scene.solver.damping = 0.002 * omega(dimension);
            let shape = Shape::of_union("dimer", &members(&[0.4 * DVec3::NEG_X, 0.4 * DVec3::X]), dimension);
            let grains = std::mem::take(&mut scene.grains);
            let thrown = |(k, g): (usize, &Grain)| packstone::scene::Clump {
                position: g.position,
                velocity: if k == 4 { 3.0 * speed(dimension) * DVec3::Y } else { g.velocity },
                spin: if k == 4 { DVec3::ZERO } else { 0.5 * speed(dimension) / R * DVec3::Z },
                orientation: DQuat::from_rotation_z(0.7 * k as f64),
                radius: 0.8 * R,
                fixed: k == 4,
                ..clump(0)
            };
            let clumps = grains.iter().enumerate().map(thrown).collect();
            set_clumps(&mut scene, vec![shape], clumps);
            balances(&bench, "clumps", &scene, 2000, [true, true, true]);
        }
    }
}

/// What nobody asks for is not added up.
#[test]
fn nothing_without_asking() {
    let mut simulation = CPU.start(&shaken(2));
    simulation.advance(10).unwrap();
    let sample = simulation.sample().unwrap();
    assert_eq!([sample.dissipated, sample.work_walls, sample.work_fixed], [None; 3]);
}
