//! Physics knows no order of grains, no origin, no direction, no hand, and no seam of a periodic domain.

use crate::{common::*, gas, speed, violent};
use glam::{DQuat, DVec3};
use packstone::scene::{Assembly, Dashpot, Grain, Surface};

/// The cases of the symmetry tests: name, scene, steps.
fn scenes() -> Vec<(&'static str, Assembly, u64)> {
    let mut box3 = gas(3, 3, 0.4, Dashpot::Restitution(0.9));
    box3.gravity = DVec3::new(10.0, 20.0, -50.0);
    for axis in 0..3 {
        let side = 3.0 * SPACING;
        box3.walls.push(plane(DVec3::ZERO, DVec3::AXES[axis]));
        box3.walls.push(plane(DVec3::AXES[axis] * side, -DVec3::AXES[axis]));
    }
    box3.walls[1].velocity = DVec3::new(0.0, 0.3 * speed(3), 0.0);
    vec![("2D gas", gas(2, 6, 0.5, Dashpot::Restitution(0.8)), 300), ("3D box", box3, 200)]
}

/// How far two runs of the same physics may differ. Each rounds its coordinates at every step by up to half an ulp,
/// which in free flight goes the same way every time, and collisions make it grow: 2 steps times what the worst of four
/// shakes of the start by up to one rounding error, at a coordinate `member_offset`, does to the end.
fn rounding(bench: Bench, scene: &Assembly, steps: u64, offset: f64) -> f64 {
    let eps = bench.pick(f64::EPSILON, f64::from(f32::EPSILON));
    let expected = CPU.after(scene, steps); // in f64, so that only the shaking differs
    let spread = |seed: u64| {
        let mut random = Random(seed);
        let mut shaken = scene.clone();
        for g in &mut shaken.grains {
            g.position += eps * offset * random.vector(scene.dimension);
            g.velocity *= 1.0 + eps * random.sign();
        }
        distance(scene, &CPU.after(&shaken, steps), &expected)
    };
    let allowed = 2.0 * steps as f64 * (1..=4).map(spread).fold(0.0, f64::max);
    allowed.min(bench.pick(1e-8, 1e-2)) // far below what different physics does, in any case
}

#[track_caller]
fn same(what: &str, bench: Bench, scene: &Assembly, a: &[Grain], b: &[Grain], allowed: f64) {
    let found = distance(scene, a, b);
    println!("{what} on {}: {found:.1e} of {allowed:.1e}", bench.name);
    assert!(found <= allowed, "{what} on {}: {found:e}, allowed {allowed:e}", bench.name);
}

/// The order of the input decides only the order of sums.
#[test]
fn permutation() {
    for (name, scene, steps) in scenes() {
        let count = scene.grains.len();
        let place = |k: usize| (k * 5 + 2) % count; // 5 is prime to 27 and 36
        let mut permuted = scene.clone();
        for k in 0..count {
            permuted.grains[place(k)] = scene.grains[k];
        }
        for bench in engines() {
            let a = bench.after(&scene, steps);
            let b = bench.after(&permuted, steps);
            let b: Vec<Grain> = (0..count).map(|k| b[place(k)]).collect();
            same(name, bench, &scene, &b, &a, rounding(bench, &scene, steps, 3.0 * SPACING));
        }
    }
}

/// Physics knows no origin: 1,000 radii away nothing changes beyond rounding. In f64 rounding is that of the far
/// positions; in f32 positions carry a residue, and only the walls' own places are rounded there.
#[test]
fn translation() {
    for (name, scene, steps) in scenes() {
        for bench in engines() {
            let offset = 1000.0 * R;
            let shift =
                offset * if scene.dimension == 2 { DVec3::new(1.0, -0.7, 0.0) } else { DVec3::new(1.0, -0.7, 0.3) };
            let mut moved = scene.clone();
            moved.grains.iter_mut().for_each(|g| g.position += shift);
            for wall in &mut moved.walls {
                if let Surface::Plane { point, .. } = &mut wall.surface {
                    *point += shift;
                }
            }
            let mut a = bench.after(&moved, steps);
            a.iter_mut().for_each(|g| g.position -= shift);
            same(
                name,
                bench,
                &scene,
                &a,
                &bench.after(&scene, steps),
                rounding(
                    bench,
                    &scene,
                    steps,
                    bench.pick(offset, if scene.walls.is_empty() { 0.0 } else { offset }) + 6.0 * SPACING,
                ),
            );
        }
    }
}

fn rotated(scene: &Assembly, turn: DQuat) -> Assembly {
    let mut turned = scene.clone();
    turned.gravity = turn * scene.gravity;
    for wall in &mut turned.walls {
        wall.velocity = turn * wall.velocity;
        if let Surface::Plane { point, normal } = &mut wall.surface {
            (*point, *normal) = (turn * *point, turn * *normal);
        }
    }
    turned.grains = turn_grains(&scene.grains, turn);
    turned
}

fn turn_grains(grains: &[Grain], turn: DQuat) -> Vec<Grain> {
    let of = |g: &Grain| Grain { position: turn * g.position, velocity: turn * g.velocity, spin: turn * g.spin, ..*g };
    grains.iter().map(of).collect()
}

/// Physics knows no direction: a quarter turn and an odd angle, about z in the plane, about any axis in space.
#[test]
fn rotation() {
    for (name, scene, steps) in scenes() {
        let axis = if scene.dimension == 2 { DVec3::Z } else { DVec3::new(1.0, -2.0, 0.5).normalize() };
        let odd = DQuat::from_axis_angle(axis, 1.234);
        let quarter =
            DQuat::from_axis_angle(if scene.dimension == 2 { DVec3::Z } else { DVec3::Y }, 0.5 * std::f64::consts::PI);
        for (turn, angle) in [(quarter, "quarter"), (odd, "odd")] {
            let mut turned = rotated(&scene, turn);
            if scene.dimension == 2 {
                // What the quaternion's rounding leaves along z is no physics.
                turned.grains.iter_mut().for_each(|g| (g.position.z, g.velocity.z) = (0.0, 0.0));
                turned.grains.iter_mut().for_each(|g| (g.spin.x, g.spin.y) = (0.0, 0.0));
            }
            for bench in engines() {
                let back = turn_grains(&bench.after(&turned, steps), turn.inverse());
                let what = format!("{name}, {angle}");
                let allowed = rounding(bench, &scene, steps, 4.0 * SPACING);
                same(&what, bench, &scene, &back, &bench.after(&scene, steps), allowed);
            }
        }
    }
}

/// Mirror images: spins are axial vectors.
#[test]
fn reflection() {
    for (name, scene, steps) in scenes() {
        let flip = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
        let axial = |v: DVec3| DVec3::new(v.x, -v.y, -v.z);
        let mirror = |grains: &[Grain]| -> Vec<Grain> {
            let of =
                |g: &Grain| Grain { position: flip(g.position), velocity: flip(g.velocity), spin: axial(g.spin), ..*g };
            grains.iter().map(of).collect()
        };
        let mut mirrored = scene.clone();
        mirrored.gravity = flip(scene.gravity);
        mirrored.grains = mirror(&scene.grains);
        for wall in &mut mirrored.walls {
            wall.velocity = flip(wall.velocity);
            if let Surface::Plane { point, normal } = &mut wall.surface {
                (*point, *normal) = (flip(*point), flip(*normal));
            }
        }
        for bench in engines() {
            let back = mirror(&bench.after(&mirrored, steps));
            let allowed = rounding(bench, &scene, steps, 3.0 * SPACING);
            same(name, bench, &scene, &back, &bench.after(&scene, steps), allowed);
        }
    }
}

/// The seam of a periodic domain is nowhere: shifted by half a cell the same happens, contacts with their springs
/// included.
#[test]
fn seamless() {
    for dimension in [2, 3] {
        let (scene, _) = violent(dimension);
        let steps = 150;
        let length = scene.domain.upper.x;
        for bench in engines() {
            let shift = 0.5 * length * if dimension == 2 { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
            let mut shifted = scene.clone();
            for g in &mut shifted.grains {
                g.position += shift;
                for axis in 0..dimension {
                    if g.position[axis] >= length {
                        g.position[axis] -= length;
                    }
                }
            }
            let mut back = bench.after(&shifted, steps);
            back.iter_mut().for_each(|g| g.position -= shift);
            let allowed = rounding(bench, &scene, steps, length);
            same(&format!("{dimension}D"), bench, &scene, &back, &bench.after(&scene, steps), allowed);
        }
    }
}
