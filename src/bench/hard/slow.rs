//! Slow changes of fast things: what a step changes by down to 1e-9 of its value, in single precision too, where a number
//! has 6e-8 of itself as last digit.

use super::common::*;
use super::figure::{Figure, Length, worse};
use crate::scene::{Clump, Grain, Method, Shape, Surface};
use glam::{DQuat, DVec3};

/// What a step changes by, over what is changed.
const PARTS: [f64; 3] = [1e-6, 3e-8, 1e-9];
const STEPS: u64 = 500;

/// How far a change over `STEPS` steps is off, over itself; worst of all that are looked at.
struct Worst(f64);

impl Worst {
    fn see(&mut self, found: DVec3, before: DVec3, change: DVec3) {
        self.0 = worse(self.0, ((found - before) - change).abs().max_element() / change.length());
    }

    /// It is right to 1e-4; in f64 to what rounding leaves of 1e-9.
    fn figure(self, bench: Bench, what: &str) -> Figure {
        Figure::zero(format!("{what}: change in 500 steps, relative error"), bench.pick(1e-5, 1e-4), self.0)
    }
}

/// Each of them with springs and with contact dynamics.
pub fn slow_changes(bench: Bench, _: Length) -> Vec<Figure> {
    [flight(bench), sliding(bench), tumbling(bench), springs(bench), walls(bench)].into_iter().flatten().collect()
}

/// Gravity and global damping on what flies, both ways.
fn flight(bench: Bench) -> Vec<Figure> {
    let [mut velocity, mut spin] = [Worst(0.0), Worst(0.0)];
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
            let as_clump = |grain: &Grain| Clump {
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
                let mut simulation = bench.start(&scene);
                simulation.advance(STEPS).unwrap();
                let of_grain = |g: &Grain| (g.velocity, g.spin);
                let of_clump = |c: &Clump| (c.velocity, c.spin);
                let (now, before): (Vec<_>, Vec<_>) = if scene.clumps.is_empty() {
                    (
                        simulation.grains().unwrap().iter().map(of_grain).collect(),
                        scene.grains.iter().map(of_grain).collect(),
                    )
                } else {
                    (
                        simulation.clumps().unwrap().iter().map(of_clump).collect(),
                        scene.clumps.iter().map(of_clump).collect(),
                    )
                };
                for ((v, w), (v0, w0)) in now.into_iter().zip(before) {
                    velocity.see(v, v0, change(v0, scene.gravity));
                    spin.see(w, w0, change(w0, DVec3::ZERO));
                }
            }
        }
    }
    vec![velocity.figure(bench, "velocity, gravity and damping"), spin.figure(bench, "spin, damping")]
}

/// Friction slows a bead on a floor, by μ g, and spins it up, by μ g R/(J/m), both ways.
fn sliding(bench: Bench) -> Vec<Figure> {
    let [mut velocity, mut spin] = [Worst(0.0), Worst(0.0)];
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
                let mut simulation = bench.start(&scene);
                // Until the spring is full.
                simulation.advance(50).unwrap();
                let before = simulation.grains().unwrap();
                simulation.advance(STEPS).unwrap();
                let time = STEPS as f64 * dt;
                for (now, before) in simulation.grains().unwrap().iter().zip(&before) {
                    let slowed = -friction * G * time * before.velocity.x.signum() * DVec3::X;
                    let along = DVec3::X * DVec3::X.dot(now.velocity);
                    velocity.see(along, DVec3::X * before.velocity.x, slowed);
                    let spun = (arm * down).cross(slowed) / (gyration(dimension) * R * R);
                    spin.see(now.spin, before.spin, spun);
                }
            }
        }
    }
    vec![velocity.figure(bench, "velocity, friction"), spin.figure(bench, "spin, friction")]
}

/// A clump that spins about none of its axes tumbles at the rate that Euler's equations give, and keeps its angular
/// momentum.
fn tumbling(bench: Bench) -> Vec<Figure> {
    let mut tumbled = Worst(0.0);
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
            tumbled.see(after(&bench), spin, expected);
        }
    }
    vec![tumbled.figure(bench, "spin, tumbling, against f64")]
}

/// Springs that hold a load: feet stand on a floor that gravity pushes them along, under a plate that slides slowly. The
/// springs of the plate and of the floor share what it moves, though a step is too little for the last digit of theirs.
fn springs(bench: Bench) -> Vec<Figure> {
    let (part, mut moved) = (1e-8, 0.0);
    let rows =
        [vec![DVec3::ZERO, 2.0 * DVec3::X], vec![DVec3::ZERO, 2.0 * DVec3::X, DVec3::new(1.0, 3f64.sqrt(), 0.0)]];
    for (dimension, feet) in [2, 3].into_iter().zip(rows) {
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
        let mut simulation = bench.start(&scene);
        simulation.advance(4_000).unwrap();
        let before = simulation.clumps().unwrap()[0].position;
        simulation.advance(8_000).unwrap();
        let gone = (simulation.clumps().unwrap()[0].position - before).x;
        moved = worse(moved, (gone / (8_000.0 * part * held) - 1.0).abs());
    }
    vec![Figure::zero(
        "way of what a loaded spring holds: change in 8,000 steps, relative error",
        bench.pick(1e-4, 1e-2),
        moved,
    )]
}

/// Walls that move little beside where they are.
fn walls(bench: Bench) -> Vec<Figure> {
    let mut gone = Worst(0.0);
    for part in PARTS {
        let place = 0.73;
        let mut scene = blank_dt(3, 1e-6);
        scene.grains = vec![grain(0.0, 0.0, 0.0)];
        scene.walls = vec![plane(-place * DVec3::Z, DVec3::Z)];
        scene.walls[0].velocity = part * place / 1e-6 * DVec3::Z;
        let mut simulation = bench.start(&scene);
        simulation.advance(STEPS).unwrap();
        let Surface::Plane { point, .. } = simulation.walls().unwrap()[0].surface else { unreachable!() };
        gone.see(DVec3::Z * point.z, -place * DVec3::Z, STEPS as f64 * part * place * DVec3::Z);
    }
    vec![gone.figure(bench, "place of a wall")]
}
