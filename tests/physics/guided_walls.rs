//! Walls that oscillate, turn, follow a table, start and stop.

use crate::{common::*, shared::*};
use glam::DVec3;
use packstone::scene::{Dashpot, Motion, Oscillation, Surface, Turning};
use std::f64::consts::TAU;

/// Over thousands of steps walls are where the closed forms have them, in single precision to digits that it has not.
#[test]
fn walls_are_where_closed_forms_have_them() {
    let dt = 1e-5;
    for bench in engines() {
        let mut scene = blank_dt(3, dt);
        scene.grains = vec![grain(0.0, 0.0, 0.0)];
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        let (amplitude, frequency, rate) = (1e-3, 37.0, 3.0);
        let table = vec![(0.0, DVec3::ZERO), (0.01, y * 2e-3), (0.03, y * -1e-3)];
        let oscillation = Some(Oscillation { amplitude: amplitude * x, frequency, interval: None });
        let turning = Some(Turning { point: 0.05 * x, axis: z, rate });
        let moved = |wall, motion| packstone::scene::Wall { motion, ..wall };
        scene.walls = vec![
            moved(plane(-0.05 * x, x), Motion { oscillation, ..Motion::default() }),
            moved(plane(-0.04 * y, y), Motion { table, ..Motion::default() }),
            moved(plane(-0.03 * z, z), Motion { start: 0.005, stop: 0.02, ..Motion::default() }),
            moved(plane(0.05 * x, -x), Motion { turning, ..Motion::default() }),
            plane(0.04 * y, -y),
        ];
        scene.walls[2].velocity = 0.1 * z;
        scene.walls[4].velocity = -0.2 * y;
        let mut simulation = bench.start(&scene);
        for _ in 0..8 {
            simulation.advance(499).unwrap();
            let t = simulation.time();
            let walls = simulation.walls().unwrap();
            let of_table = if t < 0.01 { 0.2 * t } else { (2e-3 - 0.15 * (t - 0.01)).max(-1e-3) };
            let expected = [
                0.05 - amplitude * (TAU * frequency * t).sin(),
                0.04 - of_table,
                0.03 - 0.1 * (t.min(0.02) - 0.005).max(0.0),
                0.05 * (rate * t).cos(),
                0.04 - 0.2 * t,
            ];
            for (wall, expected) in walls.iter().zip(expected) {
                let distance = wall.surface.distance(DVec3::ZERO);
                let off = (distance - expected).abs();
                assert!(
                    off < bench.pick(1e-15, 1e-13),
                    "{}: t = {t} s: {distance}, not {expected}: {off:e}",
                    bench.name
                );
            }
            let Surface::Plane { normal, .. } = walls[3].surface else { panic!("a plane") };
            let turned = DVec3::new(-(rate * t).cos(), -(rate * t).sin(), 0.0);
            assert!((normal - turned).length() < bench.pick(1e-15, 1e-13), "{}: {normal}", bench.name);
            assert!(
                (walls[4].velocity + 0.2 * y).length() < 1e-7
                    && (0.005..0.02).contains(&t) == (walls[2].velocity.z > 0.0)
            );
        }
    }
}

/// A grain that lies on a floor which swings slowly and gently goes with it.
#[test]
fn a_grain_rides_on_a_floor_that_swings() {
    for dimension in [2, 3] {
        for bench in engines() {
            let n = up(dimension);
            let overlap = mass(dimension, R) * G / bed_law(dimension, 0.0).normal_stiffness;
            let (amplitude, frequency) = (4e-6, 20.0);
            let dt = TAU / (G / overlap).sqrt() / 40.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![bed_law(dimension, 0.0)];
            scene.pairs[0].dashpot = Dashpot::Restitution(0.3);
            scene.gravity = -G * n;
            scene.walls = vec![plane(-n * (R - overlap), n)];
            let oscillation = Some(Oscillation { amplitude: amplitude * n, frequency, interval: None });
            scene.walls[0].motion = Motion { oscillation, ..Motion::default() };
            scene.grains = vec![grain(0.0, 0.0, 0.0)];
            let mut simulation = bench.start(&scene);
            for _ in 0..8 {
                simulation.advance((0.2 / frequency / dt) as u64).unwrap();
                let height = simulation.grains().unwrap()[0].position.dot(n);
                let expected = amplitude * (TAU * frequency * simulation.time()).sin();
                close("height", height, expected, amplitude, 0.02);
            }
        }
    }
}

/// A rigid grain goes with it, to the gap that is taken for a contact, also where a table jerks the floor down.
#[test]
fn a_rigid_grain_goes_with_its_floor() {
    for dimension in [2, 3] {
        for bench in engines() {
            let n = up(dimension);
            let (amplitude, frequency, dt) = (1e-4, 10.0, 4e-4);
            let mut scene = rigid(dimension, dt, 0.0, 1e-6);
            scene.gravity = -G * n;
            scene.walls = vec![plane(-n * R, n)];
            let oscillation = Some(Oscillation { amplitude: amplitude * n, frequency, interval: None });
            let table = vec![(0.0, DVec3::ZERO), (0.05, amplitude * n), (0.1, DVec3::ZERO)];
            scene.walls[0].motion = Motion { oscillation, table, ..Motion::default() };
            scene.grains = vec![grain(0.0, 0.0, 0.0)];
            let mut simulation = bench.start(&scene);
            for _ in 0..8 {
                simulation.advance((0.2 / frequency / dt) as u64).unwrap();
                let t = simulation.time();
                let height = simulation.grains().unwrap()[0].position.dot(n);
                let of_table = amplitude * (1.0 - (t / 0.05 - 1.0).abs()).max(0.0);
                let expected = amplitude * (TAU * frequency * t).sin() + of_table;
                close("height", height, expected, R, 1e-4);
            }
        }
    }
}

/// A ball that rolls on a turntable goes in a circle, with 2/7 of the spin of the table (Weltner 1979).
#[test]
fn a_ball_circles_on_a_turntable() {
    let (rate, speed) = (200.0, 0.05);
    for bench in engines() {
        let overlap = mass(3, R) * G / bed_law(3, 0.5).normal_stiffness;
        let dt = TAU / (2.0 * stick_frequency(3)) / 40.0;
        let mut scene = blank_dt(3, dt);
        scene.pairs = vec![bed_law(3, 0.5)];
        scene.gravity = -G * DVec3::Z;
        scene.walls = vec![plane(-DVec3::Z * (R - overlap), DVec3::Z)];
        let turning = Some(Turning { point: DVec3::new(0.0, 0.0, 0.3), axis: DVec3::Z, rate });
        scene.walls[0].motion = Motion { turning, ..Motion::default() };
        let place = DVec3::new(0.01, 0.0, 0.0);
        let mut ball = grain(place.x, place.y, place.z);
        ball.velocity = speed * DVec3::X;
        // Where it touches it goes as fast as the table.
        ball.spin = DVec3::Z.cross(ball.velocity - rate * DVec3::Z.cross(place)) / R;
        scene.grains = vec![ball];
        let mut simulation = bench.start(&scene);
        for _ in 0..3 {
            simulation.advance((7.0 / (2.0 * rate) / 3.0 / dt) as u64).unwrap();
            let (sin, cos) = (2.0 * rate / 7.0 * simulation.time()).sin_cos();
            let now = simulation.grains().unwrap()[0];
            close("along", now.velocity.x, speed * cos, speed, 1.5e-2);
            close("across", now.velocity.y, speed * sin, speed, 1.5e-2);
        }
    }
}

/// A paddle that turns about a far axis throws a grain at rest with twice the speed that it has there.
#[test]
fn a_paddle_throws_a_grain() {
    let (arm, rate, gap) = (0.02, 10.0, 1e-4);
    for dimension in [2, 3] {
        for bench in engines() {
            let dt = TAU / 2.0 / omega(dimension) / 50.0;
            let mut scene = blank_dt(dimension, dt);
            scene.pairs = vec![law(0.0)];
            scene.walls = vec![plane(DVec3::ZERO, DVec3::Y)];
            let turning = Some(Turning { point: DVec3::ZERO, axis: DVec3::Z, rate });
            scene.walls[0].motion = Motion { turning, ..Motion::default() };
            scene.grains = vec![grain(arm, R + gap, 0.0)];
            let mut simulation = bench.start(&scene);
            let hit = gap / (rate * arm);
            simulation.advance(((hit + 3.0 * TAU / 2.0 / omega(dimension)) / dt) as u64).unwrap();
            let thrown = simulation.grains().unwrap()[0];
            close("speed", thrown.velocity.y, 2.0 * rate * arm, rate * arm, 2e-2);
        }
    }
}
