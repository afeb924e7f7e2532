//! Slow changes of fast things: what a step changes by down to 1e-9 of its value has to be right to 1e-4, in single
//! precision too, where a number has 6e-8 of itself as last digit.

use crate::{common::*, shared::*};
use glam::{DQuat, DVec3};
use packstone::{
    check::check,
    scene::{Assembly, Clump, Method, Pair, Shape, Surface},
    simulation::EngineChoice,
};

/// What a step changes by, over what is changed.
const PARTS: [f64; 3] = [1e-6, 3e-8, 1e-9];
const STEPS: u64 = 500;

/// The change over `STEPS` steps is right to 1e-4; in f64 to what rounding leaves of 1e-9.
#[track_caller]
fn changes(what: &str, bench: &Bench, found: DVec3, before: DVec3, change: DVec3) {
    let error = ((found - before) - change).abs().max_element();
    close(&format!("{}: {what}", bench.name), error, 0.0, change.length(), bench.pick(1e-5, 1e-4));
}

/// The same scene with rigid grains.
fn rigid_too(scene: Assembly) -> [Assembly; 2] {
    let Method::ContactDynamics(mut relaxation) = rigid(3, 1.0, 0.0, 1e-6).solver.method else { unreachable!() };
    relaxation.gyroscopic = true;
    let mut second = scene.clone();
    second.solver.method = Method::ContactDynamics(relaxation);
    second.pairs.iter_mut().for_each(|pair| *pair = Pair { friction: pair.friction, ..Pair::default() });
    [scene, second]
}

/// Of four spheres round a corner, no two of its moments the same.
fn corner(dimension: usize) -> Shape {
    let centers = [DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, 1.5 * DVec3::Y];
    Shape::of_union("corner", &members(&centers), dimension)
}

/// Gravity and global damping on what flies, both ways.
#[test]
fn flight() {
    for dimension in [2, 3] {
        for part in PARTS {
            let speed = 4.2;
            let mut scene = blank_dt(dimension, part * speed / G);
            scene.gravity = -G * up(dimension);
            scene.solver.damping = 0.5 * G / speed;
            scene.grains = (0..2).map(|k| grain(9.0 * R * f64::from(k), 0.0, 0.0)).collect();
            for (grain, sign) in scene.grains.iter_mut().zip([1.0, -1.0]) {
                grain.velocity = sign * speed * (up(dimension) - 0.3 * DVec3::X);
                grain.spin = sign * 170.0 * if dimension == 2 { DVec3::Z } else { DVec3::new(0.7, -0.2, 1.0) };
            }
            let mut clumps = scene.clone();
            let as_clump = |grain: &packstone::scene::Grain| Clump {
                position: grain.position,
                velocity: grain.velocity,
                // A clump turns about its own axes, unless about one of them.
                spin: grain.spin.z * DVec3::Z,
                ..clump(0)
            };
            let all = scene.grains.iter().map(as_clump).collect();
            set_clumps(&mut clumps, vec![corner(dimension)], all);
            let time = STEPS as f64 * part * speed / G;
            // v approaches its limit g/ξ exponentially; the scheme does so to (ξ Δt)².
            let damping = scene.solver.damping;
            let change = |v: DVec3, gravity: DVec3| (v - gravity / damping) * (-damping * time).exp_m1();
            for scene in rigid_too(scene.clone()).into_iter().chain(rigid_too(clumps)) {
                for bench in engines() {
                    let mut simulation = bench.start(&scene);
                    simulation.advance(STEPS).unwrap();
                    if scene.clumps.is_empty() {
                        for (now, before) in simulation.grains().unwrap().iter().zip(&scene.grains) {
                            let v = change(before.velocity, scene.gravity);
                            changes("velocity of a grain", &bench, now.velocity, before.velocity, v);
                            changes("spin", &bench, now.spin, before.spin, change(before.spin, DVec3::ZERO));
                        }
                    } else {
                        for (now, before) in simulation.clumps().unwrap().iter().zip(&scene.clumps) {
                            let v = change(before.velocity, scene.gravity);
                            changes("velocity of a clump", &bench, now.velocity, before.velocity, v);
                            changes("spin", &bench, now.spin, before.spin, change(before.spin, DVec3::ZERO));
                        }
                    }
                }
            }
        }
    }
}

/// Friction slows a bead on a floor, by μ g, and spins it up, by μ g R/(J/m), both ways.
#[test]
fn sliding() {
    let (friction, speed) = (0.3, 5.0);
    for dimension in [2, 3] {
        for part in [1e-6, 1e-9] {
            let dt = part * speed / (friction * G);
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, friction)];
            scene.gravity = -G * up(dimension);
            scene.walls = vec![floor(dimension)];
            scene.grains = (0..2).map(|k| grain(9.0 * R * f64::from(k), 0.0, 0.0)).collect();
            let down = -up(dimension);
            for (grain, sign) in scene.grains.iter_mut().zip([-1.0, 1.0]) {
                grain.position -= down * R * (1.0 - 1e-4);
                grain.velocity = sign * speed * DVec3::X;
            }
            for mut scene in rigid_too(scene) {
                let mut arm = R * (1.0 - 0.5e-4);
                if matches!(scene.solver.method, Method::ContactDynamics(_)) {
                    scene.grains.iter_mut().for_each(|grain| grain.position -= 1e-4 * R * down);
                    arm = R;
                }
                for bench in engines() {
                    let mut simulation = bench.start(&scene);
                    // Until the spring is full.
                    simulation.advance(50).unwrap();
                    let before = simulation.grains().unwrap();
                    simulation.advance(STEPS).unwrap();
                    let time = STEPS as f64 * dt;
                    for (now, before) in simulation.grains().unwrap().iter().zip(&before) {
                        let slowed = -friction * G * time * before.velocity.x.signum() * DVec3::X;
                        let along = DVec3::X * DVec3::X.dot(now.velocity);
                        changes("velocity", &bench, along, DVec3::X * before.velocity.x, slowed);
                        let spun = (arm * down).cross(slowed) / (gyration(dimension) * R * R);
                        changes("spin", &bench, now.spin, before.spin, spun);
                    }
                }
            }
        }
    }
}

/// A clump that spins about none of its axes tumbles at the rate that Euler's equations give, and keeps its angular
/// momentum.
#[test]
fn tumbling() {
    for part in [1e-5, 1e-7] {
        let spin = 170.0 * DVec3::new(0.7, -0.2, 1.0);
        let mut scene = blank_dt(3, part / spin.length());
        let clump = Clump { spin, orientation: DQuat::from_rotation_x(0.4), ..clump(0) };
        set_clumps(&mut scene, vec![corner(3)], vec![clump]);
        for scene in rigid_too(scene) {
            let after = |bench: &Bench| {
                let mut simulation = bench.start(&scene);
                simulation.advance(STEPS).unwrap();
                simulation.clumps().unwrap()[0].spin
            };
            let expected = after(&CPU) - spin;
            assert!(expected.length() > 0.1 * part * STEPS as f64 * spin.length(), "it tumbles");
            for bench in engines() {
                changes("spin", &bench, after(&bench), spin, expected);
            }
        }
    }
}

/// Springs that hold a load: feet stand on a floor that gravity pushes them along, under a plate that slides slowly. The
/// springs of the plate and of the floor share what it moves, though a step is too little for the last digit of theirs.
#[test]
fn springs() {
    let rows =
        [vec![DVec3::ZERO, 2.0 * DVec3::X], vec![DVec3::ZERO, 2.0 * DVec3::X, DVec3::new(1.0, 3f64.sqrt(), 0.0)]];
    for (dimension, feet) in [2, 3].into_iter().zip(rows) {
        for part in [1e-8] {
            let law = bed_law(dimension, 10.0);
            let dt = 0.05 * (mass(dimension, R) / law.normal_stiffness).sqrt();
            let held = 0.2 * mass(dimension, R) * G / law.tangential_stiffness;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![law];
            scene.gravity = G * (0.2 * DVec3::X - up(dimension));
            scene.solver.damping = 0.5 / (20.0 * dt);
            let plate = plane(2.0 * R * (1.0 - 1e-4) * up(dimension), -up(dimension));
            scene.walls = vec![floor(dimension), plate];
            scene.walls[1].velocity = 2.0 * part * held / dt * DVec3::X;
            // As heavy as its feet.
            let radius = R * (feet.len() as f64).powf(1.0 / dimension as f64);
            let standing = Clump { radius, position: R * (1.0 - 1e-4) * up(dimension), ..clump(0) };
            set_clumps(&mut scene, vec![Shape::of_union("feet", &members(&feet), dimension)], vec![standing]);
            for bench in engines() {
                let mut simulation = bench.start(&scene);
                simulation.advance(4_000).unwrap();
                let before = simulation.clumps().unwrap()[0].position;
                simulation.advance(8_000).unwrap();
                let gone = (simulation.clumps().unwrap()[0].position - before).x;
                let expected = 8_000.0 * part * held;
                println!("{} {dimension}D {part:e}: {}", bench.name, gone / expected);
                close(&format!("{} {dimension}D {part:e}", bench.name), gone, expected, expected, 1e-2);
            }
        }
    }
}

/// Walls that move little beside where they are.
#[test]
fn walls() {
    for part in PARTS {
        let place = 0.73;
        let mut scene = blank_dt(3, 1e-6);
        scene.grains = vec![grain(0.0, 0.0, 0.0)];
        scene.walls = vec![plane(-place * DVec3::Z, DVec3::Z)];
        scene.walls[0].velocity = part * place / 1e-6 * DVec3::Z;
        for bench in engines() {
            let mut simulation = bench.start(&scene);
            simulation.advance(STEPS).unwrap();
            let Surface::Plane { point, .. } = simulation.walls().unwrap()[0].surface else { unreachable!() };
            let gone = STEPS as f64 * part * place * DVec3::Z;
            changes("wall", &bench, DVec3::Z * point.z, -place * DVec3::Z, gone);
        }
    }
}

/// `check` sees what gets lost over many steps, and here nothing does: a bead that slides at 5 m/s, at a step that
/// changes its speed by 1e-7.
#[test]
fn balances_hold() {
    let (friction, speed) = (0.3, 5.0);
    let mut scene = blank_dt(3, 1e-7 * speed / (friction * G));
    scene.pairs = vec![bed_law(3, friction)];
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor(3)];
    scene.grains = vec![grain(0.0, 0.0, R * (1.0 - 1e-4)), grain(9.0 * R, 0.0, 5.0 * R)];
    scene.grains.iter_mut().for_each(|grain| grain.velocity = speed * DVec3::X);
    for scene in rigid_too(scene) {
        for bench in engines().into_iter().filter(|bench| bench.engine == EngineChoice::Gpu) {
            let report = check(&scene, bench.options(), 0, 2, 200).unwrap();
            let balances: Vec<_> = report.rows.iter().filter(|row| row.stage == "balance").collect();
            let soft = matches!(scene.solver.method, Method::DiscreteElements);
            assert_eq!(balances.len(), if soft { 4 } else { 3 }, "{}", bench.name);
            assert!(report.passed, "{}: {:?}", bench.name, report.rows.iter().find(|row| !row.passed));
        }
    }
}
