//! A step of contact dynamics that is called solved is solved for every contact, whatever rests or flies elsewhere.

mod common;

use common::*;
use glam::DVec3;
use packstone::{
    measure::masses,
    scene::{Assembly, Grain, Method, Relaxation, Scene},
    simulation::Simulation,
};
use std::path::Path;

const DT: f64 = 1e-3;

/// Grains on a floor, with the tolerance that scenes have if they do not say.
fn on_floor(grains: Vec<Grain>) -> Assembly {
    let mut scene = rigid(3, DT, 0.5, default_tolerance());
    relaxation(&mut scene).max_iterations = 100_000;
    scene.gravity = -G * DVec3::Z;
    scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
    scene.grains = grains;
    scene
}

fn default_tolerance() -> f64 {
    let text = "dimension = 3\n[material.m]\ndensity = 1\n[[grain]]\nmaterial = \"m\"\nradius = 1\nposition = [0, 0, 0]\n\
                [solver]\nmethod = \"cd\"\ndt = 1\n[stop]\nsteps = 1\n";
    let mut scene = Scene::parse(text, "one.toml", Path::new("."), &[]).unwrap().assemble().unwrap();
    relaxation(&mut scene).tolerance
}

fn relaxation(scene: &mut Assembly) -> &mut Relaxation {
    match &mut scene.solver.method {
        Method::ContactDynamics(relaxation) => relaxation,
        Method::DiscreteElements => unreachable!("it is a scene of contact dynamics"),
    }
}

fn column(n: usize) -> Vec<Grain> {
    (0..n).map(|k| grain(0.0, 0.0, (2 * k + 1) as f64 * R)).collect()
}

fn layer(n: usize) -> Vec<Grain> {
    let side = (n as f64).sqrt().ceil() as usize;
    (0..n).map(|k| grain((8 + 4 * (k % side)) as f64 * R, (4 * (k / side)) as f64 * R, R)).collect()
}

/// The force on the floor below the first `n` grains over their weight, from what the step left them of their fall.
fn carried(simulation: &mut Simulation, n: usize, floor: DVec3) -> f64 {
    simulation.advance(1).unwrap();
    let grains = simulation.grains().unwrap();
    let left: f64 = grains[..n].iter().map(|g| g.velocity.z - floor.z).sum();
    1.0 + left / (n as f64 * G * DT)
}

fn assert_solved(simulation: &Simulation) {
    let solved = simulation.solver_statistics().unwrap();
    assert_eq!(solved.unconverged, 0, "{solved:?}");
}

#[test]
fn a_column_is_carried_whatever_is_elsewhere() {
    let shot = Grain { velocity: 0.4 * R / DT * DVec3::X, ..grain(0.0, 50.0 * R, 300.0 * R) };
    let cases = [(100, vec![]), (100, layer(1_000)), (100, layer(10_000)), (100, vec![shot]), (1_000, vec![])];
    for bench in engines() {
        for (n, elsewhere) in &cases {
            let mut simulation = bench.start(&on_floor([column(*n), elsewhere.clone()].concat()));
            let found = carried(&mut simulation, *n, DVec3::ZERO);
            close(&format!("{n} grains beside {}", elsewhere.len()), found, 1.0, 1.0, 1e-2);
            assert_solved(&simulation);
        }
    }
}

/// What is carried along at 5 m/s is solved as what rests.
#[test]
fn a_column_is_carried_along() {
    let speed = DVec3::new(0.3 * R / DT, -0.2 * R / DT, 0.1 * R / DT);
    for bench in engines() {
        let mut scene = on_floor(column(100));
        scene.walls[0].velocity = speed;
        scene.grains.iter_mut().for_each(|g| g.velocity = speed);
        let mut simulation = bench.start(&scene);
        let found = carried(&mut simulation, 100, speed);
        close("carried along", found, 1.0, 1.0, 1e-2);
        assert_solved(&simulation);
    }
}

/// A bed that rests goes on resting: creep, passes, and no step unsolved.
#[test]
fn a_bed_at_rest_stays_there() {
    for bench in engines() {
        let mut scene = on_floor(Vec::new());
        let width = 12.0 * R;
        for (axis, at) in [(DVec3::X, 0.0), (DVec3::Y, 0.0), (-DVec3::X, width), (-DVec3::Y, width)] {
            scene.walls.push(plane(at * axis.abs(), axis));
        }
        let mut random = Random(5);
        scene.grains = (0..200)
            .map(|k| {
                let place = |cell: usize| (1.2 + 2.4 * cell as f64) * R;
                let radius = R * (0.9 + 0.2 * random.unit());
                Grain { radius, ..grain(place(k % 5), place(k / 5 % 5), place(k / 25)) }
            })
            .collect();
        // To rest under damping, and then without.
        scene.solver.damping = 200.0;
        relaxation(&mut scene).max_iterations = 3_000;
        let mut simulation = bench.start(&scene);
        simulation.advance(400).unwrap();
        scene.grains = simulation.grains().unwrap().into_iter().map(|g| Grain { velocity: DVec3::ZERO, ..g }).collect();
        scene.solver.damping = 0.0;
        let mut simulation = bench.start(&scene);
        simulation.advance(50).unwrap();
        let (start, before) = (simulation.grains().unwrap(), *simulation.solver_statistics().unwrap());
        simulation.advance(600).unwrap();
        let (end, after) = (simulation.grains().unwrap(), *simulation.solver_statistics().unwrap());
        let mut creep: Vec<f64> = start.iter().zip(&end).map(|(a, b)| (a.position - b.position).length() / R).collect();
        creep.sort_by(f64::total_cmp);
        println!(
            "{bench:?}: creep {:.1e} {:.1e}, passes {}, unsolved {}",
            creep[100],
            creep[199],
            after.iterations - before.iterations,
            after.unconverged - before.unconverged
        );
        assert!(creep[100] < 1e-3, "median creep {:e} R", creep[100]);
        assert_eq!(after.unconverged, before.unconverged, "unsolved steps");
        assert!(after.iterations - before.iterations <= 40_000, "{} passes", after.iterations - before.iterations);
    }
}

/// Energy of rigid grains never grows: light ones below a heavy one, which norms do not see, and grains that fall into
/// a tray.
#[test]
fn energy_never_grows() {
    const STEPS: usize = 60;
    for bench in engines() {
        let mut heavy = on_floor(column(10));
        heavy.grains[9].radius = 20.0 * R;
        heavy.grains[9].position.z = 18.0 * R + 20.0 * R;
        let mut random = Random(9);
        let mut tray = on_floor(
            (0..60)
                .map(|k| {
                    let place = |cell: usize| (1.2 + 2.4 * cell as f64) * R;
                    Grain { velocity: 0.1 * random.vector(3), ..grain(place(k % 3), place(k / 3 % 3), place(k / 9)) }
                })
                .collect(),
        );
        for (axis, at) in [(DVec3::X, 0.0), (DVec3::Y, 0.0), (-DVec3::X, 8.0 * R), (-DVec3::Y, 8.0 * R)] {
            tray.walls.push(plane(at * axis.abs(), axis));
        }
        // In single precision the loads of the heavy one have no digits for the weight of a light one.
        let scenes = if bench.is_single() { vec![tray] } else { vec![heavy, tray] };
        for mut scene in scenes {
            // An overlap that opens lifts what lies on it.
            relaxation(&mut scene).max_correction_velocity = Some(0.0);
            relaxation(&mut scene).max_iterations = 10_000;
            let masses = masses(&scene);
            let energy = |simulation: &mut Simulation| -> f64 {
                let grains = simulation.grains().unwrap();
                grains
                    .iter()
                    .zip(&masses)
                    .map(|(g, m)| {
                        let spin = 0.4 * g.radius * g.radius * g.spin.length_squared();
                        m * (G * g.position.z + 0.5 * (g.velocity.length_squared() + spin))
                    })
                    .sum()
            };
            let mut simulation = bench.start(&scene);
            let start = energy(&mut simulation);
            let mut before = start;
            for step in 0..STEPS {
                simulation.advance(1).unwrap();
                let now = energy(&mut simulation);
                // Every step may leave 9 contacts 1e-5 of g Δt and of 5e-5 of their loads, which lifts the heavy one by
                // 1.5e-7 of its height.
                let (step_rounding, rounding) = (1e-6, STEPS as f64 * 1.5e-7);
                let what = format!("{}, step {step}: {now:e} after {before:e} and {start:e}", bench.name);
                assert!(now <= before + step_rounding * start && now <= (1.0 + rounding) * start, "{what}");
                before = now;
            }
        }
    }
}
