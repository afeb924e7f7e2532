//! `check` sees what gets lost over many steps.

use crate::{common::*, shared::*};
use glam::{DQuat, DVec3};
use packstone::{
    check::check,
    scene::{Assembly, Clump, Method},
    simulation::EngineChoice,
};

/// Here nothing gets lost: a bead that slides at 5 m/s, at a step that
/// changes its speed by 1e-7.
#[test]
fn of_beads() {
    let (friction, speed) = (0.3, 5.0);
    let mut scene = blank_dt(3, 1e-7 * speed / (friction * G));
    scene.pairs = vec![bed_law(3, friction)];
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor(3)];
    scene.grains = vec![grain(0.0, 0.0, R * (1.0 - 1e-4)), grain(9.0 * R, 0.0, 5.0 * R)];
    scene.grains.iter_mut().for_each(|grain| grain.velocity = speed * DVec3::X);
    hold(scene);
}

/// The same of clumps: one slides and is pulled over, one tumbles in the air, by 1e-7 of its spin in a step, and one
/// does not turn at all.
#[test]
fn of_clumps() {
    let (friction, speed) = (0.3, 5.0);
    let spin = 170.0 * DVec3::new(0.7, -0.2, 1.0);
    let mut scene = blank_dt(3, 1e-7 / spin.length());
    scene.pairs = vec![bed_law(3, friction)];
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![floor(3)];
    let (shape, orientation) = (corner(3), DQuat::from_rotation_x(0.4));
    let mut slides = Clump { velocity: speed * DVec3::X, spin, orientation, ..clump(0) };
    let lowest = slides.members(&shape).map(|m| m.position.z - m.radius).fold(INF, f64::min);
    slides.position.z = -lowest - 1e-4 * R;
    let tumbles = Clump { position: DVec3::new(0.0, 20.0 * R, 9.0 * R), ..slides };
    let falls = Clump { position: DVec3::new(0.0, 40.0 * R, 9.0 * R), spin: DVec3::ZERO, ..slides };
    set_clumps(&mut scene, vec![shape], vec![slides, tumbles, falls]);
    hold(scene);
}

/// The same of rigid grains that fly into each other and past each other by a third of a radius in a step.
#[test]
fn of_fast_rigid_grains() {
    let dt = 1e-4;
    for dimension in [2, 3] {
        let mut scene = rigid(dimension, dt, 0.5, 1e-6);
        scene.gravity = -G * up(dimension);
        scene.walls = vec![floor(dimension)];
        scene.grains = cloud(dimension, 4, 0.2 * R / dt, 3);
        balanced(&scene, 40);
    }
}

/// With springs and with contact dynamics.
#[track_caller]
fn hold(scene: Assembly) {
    rigid_too(scene).iter().for_each(|scene| balanced(scene, 200));
}

#[track_caller]
fn balanced(scene: &Assembly, steps: u64) {
    for bench in engines().into_iter().filter(|bench| bench.engine == EngineChoice::Gpu) {
        let report = check(scene, bench.options(), 0, 2, steps).unwrap();
        let balances: Vec<_> = report.rows.iter().filter(|row| row.stage == "balance").collect();
        println!("{}: {balances:?}", bench.name);
        let soft = matches!(scene.solver.method, Method::DiscreteElements);
        let expected = if soft { 4 } else { 3 } + usize::from(!scene.clumps.is_empty());
        assert_eq!(balances.len(), expected, "{}", bench.name);
        assert!(report.passed, "{}: {:?}", bench.name, report.rows.iter().find(|row| !row.passed));
    }
}
