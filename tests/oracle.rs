//! Trajectories of random clouds against an independent all-pairs reference, over every slot of the model.

mod common;

use common::{oracle::Oracle, *};
use glam::DVec3;
use packstone::scene::{Assembly, Dashpot, Pair};

/// Walls of a case; the box and the cylinder move or spin.
#[derive(Clone, Copy, PartialEq)]
enum Walls {
    None,
    Box,
    MovingBox,
    Drum,
    MovingDrum,
}

struct Case {
    name: &'static str,
    dimension: usize,
    periodic: [bool; 3],
    friction: f64,
    two_materials: bool,
    dashpot: Dashpot,
    damping: f64,
    walls: Walls,
    fixed: bool,
}

const OPEN: [bool; 3] = [false; 3];

#[rustfmt::skip]
fn cases() -> Vec<Case> {
    use Dashpot::{MassScaled, Restitution};
    let c = |name, dimension, periodic, friction, two_materials, dashpot, damping, walls, fixed| Case {
        name, dimension, periodic, friction, two_materials, dashpot, damping, walls, fixed,
    };
    vec![
        c("2D open frictionless",         2, OPEN,                 0.0, false, Dashpot::None,    0.0,   Walls::None,       false),
        c("3D open frictional",           3, OPEN,                 0.5, false, Dashpot::None,    0.0,   Walls::None,       false),
        c("2D periodic frictional",       2, [true, true, false],  0.3, true,  Restitution(0.8), 0.0,   Walls::None,       false),
        c("3D periodic frictional",       3, [true, true, true],   0.3, true,  MassScaled(4e3),  0.0,   Walls::None,       false),
        c("2D box two materials",         2, OPEN,                 0.4, true,  Restitution(0.7), 0.0,   Walls::Box,        true),
        c("3D moving box damped",         3, OPEN,                 0.6, true,  MassScaled(2e3),  200.0, Walls::MovingBox,  false),
        c("2D drum",                      2, OPEN,                 0.5, false, Restitution(0.9), 50.0,  Walls::Drum,       false),
        c("3D moving drum, periodic in z",3, [false, false, true], 0.5, true,  Dashpot::None,    0.0,   Walls::MovingDrum, true),
        c("3D periodic frictionless",     3, [true, false, true],  0.0, true,  Restitution(0.6), 0.0,   Walls::None,       true),
        c("2D moving box frictionless",   2, OPEN,                 0.0, false, MassScaled(300.), 20.0,  Walls::MovingBox,  false),
    ]
}

fn build(case: &Case) -> Assembly {
    let side = if case.dimension == 2 { 6 } else { 4 };
    let side = if case.walls == Walls::None { side } else { side - 1 };
    // Disks of unit thickness are 750 times as heavy: slower by the root of it, so that overlaps stay near 1 % of R.
    let slower = (mass(2, R) / mass(3, R)).sqrt();
    let pace = if case.dimension == 2 { 1.0 / slower } else { 1.0 };
    let speed = 0.8 * pace;
    let mut scene = blank_dt(case.dimension, 2e-6 / pace);
    scene.grains = cloud(case.dimension, side.max(3), speed, 11 + case.name.len() as u64);
    scene.gravity = DVec3::new(30.0, -50.0, if case.dimension == 2 { 0.0 } else { 40.0 }) * pace * pace;
    scene.solver.damping = case.damping * pace;
    let dashpot = match case.dashpot {
        Dashpot::MassScaled(eta) => Dashpot::MassScaled(eta * pace),
        other => other,
    };
    let first = Pair { dashpot, ..law(case.friction) };
    scene.pairs = vec![first];
    if case.two_materials {
        let mixed =
            Pair { normal_stiffness: 1.4 * KN, tangential_stiffness: 0.9 * KN, friction: 0.7 * case.friction, ..first };
        let other = match dashpot {
            Dashpot::Restitution(e) => Dashpot::Restitution(0.9 * e),
            Dashpot::MassScaled(eta) => Dashpot::MassScaled(1.5 * eta),
            Dashpot::None => Dashpot::None,
        };
        let second = Pair { normal_stiffness: 0.7 * KN, dashpot: other, ..first };
        set_laws(&mut scene, &[first, mixed]);
        scene.pairs[3] = second;
        scene.materials[1].density = 1.7 * RHO;
        scene.grains.iter_mut().enumerate().for_each(|(k, g)| g.material = u32::from(k % 3 == 0));
    }
    if case.fixed {
        scene.grains[4].fixed = true; // keeps moving: a driven grain
        scene.grains[9].fixed = true;
        scene.grains[9].velocity = DVec3::ZERO;
    }
    let length = SPACING * side.max(3) as f64;
    for axis in 0..case.dimension {
        if case.periodic[axis] {
            (scene.domain.lower[axis], scene.domain.upper[axis]) = (0.0, length);
            scene.domain.periodic[axis] = true;
        }
    }
    let push = speed * DVec3::new(0.4, -0.2, 0.0);
    match case.walls {
        Walls::None => {}
        Walls::Box | Walls::MovingBox => {
            for axis in 0..case.dimension {
                for (at, sign) in [(0.0, 1.0), (length, -1.0)] {
                    scene.walls.push(plane(DVec3::AXES[axis] * at, DVec3::AXES[axis] * sign));
                }
            }
            // And one that is not aligned with anything.
            let tilted = if case.dimension == 2 { DVec3::new(1.0, 2.0, 0.0) } else { DVec3::new(1.0, 2.0, -0.5) };
            let foot = scene.grains[0].position - tilted.normalize() * 1.01 * R;
            scene.walls.push(plane(foot, tilted));
            scene.grains.retain(|g| (g.position - foot).dot(tilted.normalize()) > g.radius);
            if case.walls == Walls::MovingBox {
                scene.walls[0].velocity = DVec3::X * push.length();
                scene.walls[2].velocity = push;
            }
        }
        Walls::Drum | Walls::MovingDrum => {
            let mut drum = cylinder(0.5 * length * 1.35);
            drum.spin = 0.5 * speed / R;
            let middle = DVec3::new(0.5 * length, 0.5 * length, 0.0);
            drum.surface = packstone::scene::Surface::Cylinder { center: middle, radius: 0.5 * length * 1.35 };
            if case.walls == Walls::MovingDrum {
                drum.velocity = push;
            }
            scene.walls.push(drum);
        }
    }
    if case.two_materials {
        scene.walls.iter_mut().for_each(|w| w.material = 1);
    }
    scene
}

fn run_oracle(scene: &Assembly, steps: usize) -> Oracle {
    let mut oracle = Oracle::new(scene);
    oracle.advance(steps);
    oracle
}

#[test]
fn trajectories() {
    let steps = 800;
    let engines = engines();
    let mut wrong = Vec::new();
    for case in cases() {
        let scene = build(&case);
        let oracle = run_oracle(&scene, steps);
        let expected = oracle.grains();
        // The yardstick is the sensitivity of the scene itself. Every step rounds, with random signs, so every input is
        // shaken by √steps rounding errors; the worst of ten shakes, because only some of them move the end of a
        // contact across a step, where a dashpot's force jumps. Twice that is allowed, for the roundings within a step.
        let spread = |eps: f64| {
            let shaken = |seed: u64| {
                let mut random = Random(seed);
                let mut shaken = scene.clone();
                for g in &mut shaken.grains {
                    g.position += eps * SPACING * 4.0 * random.vector(case.dimension);
                    g.velocity *= 1.0 + eps * random.sign();
                    g.radius *= 1.0 + eps * random.sign();
                }
                shaken.gravity *= 1.0 + eps * random.sign();
                distance(&scene, &run_oracle(&shaken, steps).grains(), &expected)
            };
            (5..15).map(shaken).fold(0.0, f64::max)
        };
        let root = (steps as f64).sqrt();
        let (double, single) = (spread(f64::EPSILON * root), spread(f64::from(f32::EPSILON) * root));
        println!(
            "{}: {} grains, {} contacts, {} stuck, {} slid, spread {double:.1e} {single:.1e}",
            case.name,
            scene.grains.len(),
            oracle.begun,
            oracle.stuck,
            oracle.slid
        );
        assert!(oracle.begun > 15 && (case.friction == 0.0 || oracle.stuck.min(oracle.slid) > 100), "a tame case");
        for bench in &engines {
            let error = distance(&scene, &bench.after(&scene, steps as u64), &expected);
            let spreads = error / bench.pick(double, single);
            println!("    {:10} {error:.2e}  = {spreads:.1} spreads", bench.name);
            let fine = spreads < 2.0 && error < bench.pick(1e-10, 1e-2);
            if !fine {
                wrong.push(format!("{} on {}: {error:e}, {spreads} spreads", case.name, bench.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
