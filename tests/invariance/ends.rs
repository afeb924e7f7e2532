//! Grains that cannot be followed any further end the run, with the last good state.

use crate::common::*;
use glam::DVec3;
use packstone::{
    Error,
    scene::{Grain, TimeStep, Wall},
    simulation::Simulation,
};

/// A grain that leaves an open domain stops the run with its id and step; the state is the last good one.
#[test]
fn escape() {
    for bench in engines() {
        let mut scene = blank_dt(3, 1e-6);
        scene.grains = (0..5).map(|k| grain(0.0, 3.0 * R * f64::from(k), 0.0)).collect();
        (scene.domain.lower, scene.domain.upper) = (DVec3::splat(-2.0 * R), DVec3::splat(15.0 * R));
        scene.grains[3].velocity = DVec3::new(-10.0, 0.0, 0.0); // 2 R in 200 steps
        scene.grains[3].position.x = -0.0035 * R; // so that no step ends on the face
        let mut simulation = bench.start(&scene);
        let error = simulation.advance(1000).expect_err("it leaves");
        let Error::Run { step, time, reason } = &error else { panic!("{error}") };
        assert_eq!(*step, 200, "{error}");
        close("time", *time, 200e-6, 200e-6, 1e-12);
        assert!(
            reason.contains("grain 3") && reason.contains("left the domain") && reason.contains("open lower x face"),
            "{reason}"
        );
        assert_eq!(simulation.step(), 199);
        for (g, g0) in simulation.grains().unwrap().iter().zip(&scene.grains) {
            let path = 199e-6 * g0.velocity;
            assert!(g.position.x > -2.0 * R, "inside");
            close("position", (g.position - g0.position - path).length(), 0.0, R, bench.pick(1e-12, 1e-4));
        }
    }
}

/// A grain driven through a wall, a grain too fast to follow, and a force that is no number stop the run.
#[test]
fn hopeless_grains() {
    for bench in engines() {
        let base = || {
            let mut scene = blank_dt(3, 1e-6);
            scene.grains = (0..4).map(|k| grain(0.0, 3.0 * R * f64::from(k), 1.5 * R)).collect();
            scene.walls = vec![plane(DVec3::ZERO, DVec3::Z)];
            scene
        };
        // A lid that comes down on them, slowly, so that no impact explains what it does.
        let mut through = base();
        through.solver.dt = TimeStep::Fixed(1e-5);
        through.walls.push(Wall { velocity: DVec3::Z * -0.1, ..plane(DVec3::Z * 2.6 * R, -DVec3::Z) });
        let mut fast = base();
        fast.grains[1].velocity.x = 500.0; // half a radius per step, with a margin of a fifth
        // A force of infinity along the normal is 0 · ∞ across it.
        let mut no_number = base();
        no_number.grains[3].position.z = 0.9 * R;
        no_number.pairs[0].normal_stiffness = 1e308;
        no_number.solver.allow_unstable = true;
        if bench.is_single() {
            let error = Simulation::new(no_number.clone(), bench.options()).err().expect("out of range").to_string();
            assert!(error.contains("1e308 N/m") && error.contains("single precision"), "{error}");
        }
        let stops = [
            (through, 0, "comes at 1.0000e-1 m/s and the grains cannot give way"),
            (fast, 1, "solver.dt must be below"),
            (no_number, 3, "number"),
        ];
        for (scene, id, words) in stops.into_iter().take(bench.pick(3, 2)) {
            let mut simulation = bench.start(&scene);
            let error = simulation.advance(4000).expect_err(words);
            let text = error.to_string();
            assert!(text.contains(&format!("grain {id}")) && text.contains(words), "{}: {text}", bench.name);
            let grains = simulation.grains().unwrap();
            // The state left is the last one in which every grain has a place; a wall is found crossed where it was.
            let inside = |g: &Grain| g.position.is_finite() && g.position.z > -0.1 * R;
            assert!(grains.iter().all(inside), "{}: {grains:?}", bench.name);
        }
    }
}
