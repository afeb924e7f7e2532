//! Slow changes of fast things: what a step changes by down to 1e-9 of its value, in single precision too, where a number
//! has 6e-8 of itself as last digit.

use super::common::*;
use super::figure::{Figure, Length, worse};
use crate::scene::{Assembly, Clump, Grain, Hertz, Method, Pair, Rolling, Shape, Surface, Wall};
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
    [flight, sliding, tumbling, springs, dissipation, walls].map(|case| case(bench)).into_iter().flatten().collect()
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

/// A fifth of the time in which a grain of `bed_law` swings by a radian, s.
const HELD_DT: f64 = 2e-5;
/// What a loaded spring is stretched by in a step, over what it holds: half a unit of its last place at most.
const STRETCH: f64 = 3e-8;
const FEET: [DVec3; 3] = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(1.0, 1.7320508075688772, 0.0)];

/// What stands between a floor and a plate, squeezed by 1e-4 R and pulled along both by a fifth of its weight; both follow
/// a law of their own.
struct Held {
    dimension: usize,
    feet: Vec<DVec3>,
    laws: [Pair; 2],
    /// The part of the way of the plate that it goes.
    part_of_way: f64,
}

impl Held {
    fn scene(&self, damping: f64) -> Assembly {
        let Held { dimension, feet, laws, .. } = self;
        let up = up(*dimension);
        let mut scene = blank_dt(*dimension, HELD_DT);
        set_laws(&mut scene, laws);
        scene.gravity = 0.2 * G * DVec3::X;
        scene.solver.damping = damping;
        scene.walls = vec![floor(*dimension), Wall { material: 1, ..plane(2.0 * R * (1.0 - 1e-4) * up, -up) }];
        let position = R * (1.0 - 1e-4) * up;
        if feet.len() == 1 {
            scene.grains = vec![Grain { position, ..grain(0.0, 0.0, 0.0) }];
        } else {
            // As heavy as its feet.
            let radius = R * (feet.len() as f64).powf(1.0 / *dimension as f64);
            let shape = Shape::of_union("feet", &members(feet), *dimension);
            set_clumps(&mut scene, vec![shape], vec![Clump { radius, position, ..clump(0) }]);
        }
        scene
    }
}

/// Springs that hold a load while the plate goes slowly: those of plate and floor, and of rolling resistance, share what
/// it moves, though a step is too little for the last digit of theirs.
fn springs(bench: Bench) -> Vec<Figure> {
    // Soft ones, so that positions have digits for what they are stretched by.
    let soft = |dimension| {
        let law = bed_law(dimension, 10.0);
        Pair { tangential_stiffness: 1e-3 * law.normal_stiffness, ..law }
    };
    let clump = |dimension, feet: &[DVec3]| Held {
        dimension,
        feet: feet.to_vec(),
        laws: [soft(dimension); 2],
        part_of_way: 0.5,
    };
    let sphere = |dimension, laws, part_of_way| Held { dimension, feet: vec![DVec3::ZERO], laws, part_of_way };
    // The same force and tangential stiffness at a contact of 1e-2 R.
    let (weight, contact_radius) = (mass(3, R) * G, 1e-2 * R);
    let hertz = Hertz {
        youngs_modulus: 0.75 * weight * R / contact_radius.powi(3),
        shear_modulus: soft(3).tangential_stiffness / (8.0 * contact_radius),
    };
    let elastic = Pair { hertz: Some(hertz), friction: 10.0, ..Pair::default() };
    // Springs k and k/2 make a sphere roll, which the rolling springs, K in all, resist. Forces balance,
    // 3/2 k x - 1/2 k R θ = 1/2 k X, and torques, (3/2 k R² + K) θ = 1/2 k R (x + X).
    let rolling = |dimension| {
        let (law, stiffness) = (soft(dimension), 0.7e-3);
        let floor = Pair { rolling: Some(Rolling { friction: 10.0, stiffness, damping: 0.0 }), ..law };
        let k = law.tangential_stiffness;
        let rolled = 0.5 * k / (1.5 * k + 2.0 * stiffness * law.normal_stiffness);
        let plate = Pair { tangential_stiffness: 0.5 * k, ..floor };
        sphere(dimension, [floor, plate], (0.5 + 0.5 * rolled) / (1.5 - 0.5 * rolled))
    };
    let cases = [clump(2, &FEET[..2]), clump(3, &FEET), sphere(3, [elastic; 2], 0.5), rolling(2), rolling(3)];
    let off = cases.iter().map(|held| slowly_dragged(bench, held)).fold(0.0, worse);
    let what = "way of what loaded springs hold: change in 32,000 steps, relative error";
    vec![Figure::zero(what, bench.pick(1e-4, 0.1), off)]
}

/// How far its way is off, over itself.
fn slowly_dragged(bench: Bench, held: &Held) -> f64 {
    const STEPS: u64 = 32_000;
    let mut scene = held.scene(0.01 / HELD_DT);
    let way = STRETCH * 0.1 * mass(held.dimension, R) * G / (1e-3 * bed_law(held.dimension, 0.0).normal_stiffness);
    scene.walls[1].velocity = way / HELD_DT * DVec3::X;
    let mut simulation = bench.start(&scene);
    simulation.advance(4_000).unwrap();
    let before = simulation.grains().unwrap()[0].position;
    simulation.advance(STEPS).unwrap();
    let gone = (simulation.grains().unwrap()[0].position - before).x;
    (gone / (STEPS as f64 * held.part_of_way * way) - 1.0).abs()
}

/// What a floor dissipates that slides slowly below feet which a plate holds.
fn dissipation(bench: Bench) -> Vec<Figure> {
    const STEPS: u64 = 32_000;
    let mut off = 0.0;
    for (dimension, feet) in [(2, &FEET[..2]), (3, &FEET[..])] {
        let laws = [0.05, 10.0].map(|friction| bed_law(dimension, friction));
        let limit = 0.05 * mass(dimension, R) * G;
        let way = STRETCH * limit / laws[0].tangential_stiffness;
        // So much damping that springs are stretched to their limit once and for all.
        let mut scene = Held { dimension, feet: feet.to_vec(), laws, part_of_way: 0.0 }.scene(1.0 / HELD_DT);
        scene.walls[0].velocity = -way / HELD_DT * DVec3::X;
        scene.output.works = true;
        let mut simulation = bench.start(&scene);
        simulation.advance(4_000).unwrap();
        let before = simulation.sample().unwrap().dissipated.unwrap();
        simulation.advance(STEPS).unwrap();
        let dissipated = simulation.sample().unwrap().dissipated.unwrap() - before;
        off = worse(off, (dissipated / (STEPS as f64 * feet.len() as f64 * limit * way) - 1.0).abs());
    }
    vec![Figure::zero("dissipation of slow sliding, relative error", bench.pick(1e-4, 0.1), off)]
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
