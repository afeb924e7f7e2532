//! Springs of contacts that turn about their normal.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Assembly, Grain, Material, Pair, Rolling, Scene, TimeStep, Twist};
use std::{
    f64::consts::{FRAC_PI_2, FRAC_PI_4},
    path::Path,
};

/// A sphere between two fixed ones that press it by 1e-3 R; all spin with 50 rad/s about the line through them, and it
/// vibrates sideways.
const SCENE: &str = r#"
dimension = 3
gravity = [0, 0, 0]
stop.time = 0.0314159
[material.a]
density = 2500
normal_stiffness = 1e5
tangential_stiffness = 1e5
friction = 1e3
[[grain]]
material = "a"
radius = 0.01
position = [0, 0, -0.01999]
spin = [0, 0, 50]
fixed = true
[[grain]]
material = "a"
radius = 0.01
position = [0, 0, 0.01999]
spin = [0, 0, 50]
fixed = true
[[grain]]
material = "a"
radius = 0.01
position = [0, 0, 0]
velocity = [0.001, 0, 0]
spin = [0, 0, 50]
"#;

fn scene(twist: Twist, dt: f64) -> Assembly {
    let mut scene = Scene::parse(SCENE, "twist.toml", Path::new("."), &[]).unwrap().assemble().unwrap();
    scene.solver.twist = twist;
    scene.solver.dt = TimeStep::Fixed(dt);
    scene
}

/// The direction in which the middle sphere has moved on average in the last tenth of the run, by its second moments.
fn plane_of_vibration(mut simulation: Seen, steps: u64) -> f64 {
    simulation.advance(steps - steps / 10);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for _ in 0..100 {
        simulation.advance(steps / 1000);
        let v = simulation.grains()[2].velocity;
        (xx, xy, yy) = (xx + v.x * v.x, xy + v.x * v.y, yy + v.y * v.y);
    }
    0.5 * f64::atan2(2.0 * xy, xx - yy)
}

/// In a quarter of a turn of the spheres the plane stays, or turns back by half as much with the printed law: that is what the
/// documentation says of it. The direction is that of the middle of the last tenth.
#[test]
fn a_spring_that_follows_the_twist_keeps_its_plane() {
    let (end, dt) = (FRAC_PI_2 / 50.0, 4e-6);
    for (bench, frame) in engines().into_iter().flat_map(|bench| frames(3).map(|frame| (bench, frame))) {
        let turned = |twist: Twist| plane_of_vibration(frame.start(&bench, &scene(twist, dt)), (end / dt) as u64);
        let (kept, lost) = (turned(Twist::Followed), turned(Twist::Ignored));
        println!("{} {frame:?}: followed {kept:.4} rad, ignored {lost:.4} rad", bench.name);
        close(bench.name, kept, 0.0, 1.0, 0.01);
        close(bench.name, lost, -0.95 * FRAC_PI_4, 1.0, 0.03);
    }
}

/// What two surfaces do to each other depends on nothing that turns both. A sphere rolls and slips slowly on another, too
/// heavy to move, in a direction that stays; while both spin about the normal, so that what springs have been stretched by
/// before turns: a force that was constant is the mean of it over the angle. Hooke's and Mindlin's springs, and those of
/// rolling, by their moment.
#[test]
fn springs_turn_with_both_surfaces() {
    let rolling = Some(Rolling { friction: 0.5, stiffness: 0.5, damping: 0.0 });
    let hooke = Pair { friction: 10.0, tangential_stiffness: 0.3 * KN, rolling, ..law(10.0) };
    let hertz = packstone::scene::Hertz { youngs_modulus: 1e8, shear_modulus: 4e7 };
    let mindlin = Pair { hertz: Some(hertz), ..hooke };
    let (dt, steps, turning) = (2e-7, 2000, 2000.0);
    for (what, pair) in [("hooke", hooke), ("mindlin", mindlin)] {
        let load = |turning: f64| {
            let mut scene = blank_dt(3, dt);
            scene.solver.twist = Twist::Followed;
            scene.materials = [RHO, 1e12].map(|density| Material { name: String::new(), density }).to_vec();
            scene.pairs = vec![pair; 4];
            scene.grains = vec![
                Grain { fixed: true, spin: DVec3::new(20.0, 10.0, turning), ..grain(0.0, 0.0, 0.0) },
                Grain { material: 1, spin: DVec3::Z * turning, ..grain(0.0, 0.0, 1.99 * R) },
            ];
            let mut simulation = CPU.start(&scene);
            simulation.advance(steps).unwrap();
            simulation.forces().unwrap()[1]
        };
        let ((f, m), (g, k)) = (load(0.0), load(turning));
        let angle = turning * dt * steps as f64;
        let mean = |v: DVec3| v * (angle.sin() / angle) + DVec3::Z.cross(v) * ((1.0 - angle.cos()) / angle);
        let off = |still: DVec3, turned: DVec3| {
            let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
            (mean(flat(still)) - flat(turned)).length() / flat(still).length()
        };
        println!("{what}: {angle} rad, off by {:.2e} and {:.2e}", off(f, g), off(m, k));
        close(what, off(f, g), 0.0, 1.0, 1e-3);
        close(what, off(m, k), 0.0, 1.0, 1e-3);
    }
}
