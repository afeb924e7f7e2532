//! Where single precision does not go it says no. Where it goes: `hard range`.

use crate::common::*;
use glam::DVec3;
use packstone::{
    Error,
    scene::{Pair, TimeStep},
    simulation::Simulation,
};

/// What single precision cannot hold is refused by name, before anything runs.
#[test]
fn numbers_out_of_range() {
    let scene = || {
        let mut scene = blank(3);
        scene.grains = (0..2).map(|k| grain(5.0 * R * f64::from(k), 0.0, 0.0)).collect();
        scene
    };
    let mut spin = scene();
    spin.grains[1].spin = 1e100 * DVec3::Z;
    let mut speed = scene();
    speed.grains[1].velocity = 1e40 * DVec3::X;
    let mut soft = scene();
    set_laws(&mut soft, &[law(0.0), Pair { normal_stiffness: 1e-30 * KN, ..law(0.0) }]);
    soft.grains[1].material = 1;
    let mut tiny = scene();
    tiny.grains[1].radius = 1e-30;
    tiny.solver.allow_unstable = true;
    for (scene, words) in [
        (spin, "grain 1: spin = 1e100 1/s"),
        (speed, "grain 1: velocity.v = 1.0"),
        (soft, "pair of materials 1"),
        (tiny, "grain 1: "),
    ] {
        let error = Simulation::new(scene, GPU_SINGLE.options()).err().expect(words).to_string();
        assert!(error.contains(words) && error.contains("single precision"), "{error}");
    }
}

/// What flies so far that contacts would lose digits in single precision stops the run and says so.
#[test]
fn too_far() {
    let mut scene = blank(3);
    scene.solver.margin = 1.0;
    scene.solver.dt = TimeStep::Fixed(0.4 * R);
    scene.solver.allow_unstable = true; // nothing touches
    scene.grains = vec![grain(0.0, 0.0, 0.0), grain(9.0 * R, 0.0, 0.0)];
    scene.grains[1].velocity = DVec3::Y;
    for bench in engines() {
        let mut simulation = bench.start(&scene);
        if !bench.is_single() {
            assert!(simulation.advance(100).is_ok());
            continue;
        }
        let error = simulation.advance(60_000).expect_err("too far");
        let text = error.to_string();
        let Error::Run { step, .. } = error else { panic!("{text}") };
        assert!(text.contains("grain 1") && text.contains("single precision"), "{text}");
        let (far, before) = (step as f64 * 0.4, simulation.grains().unwrap()[1].position.y / R);
        assert!((16_000.0..17_000.0).contains(&far), "{far} R");
        close("path", before, (simulation.step() as f64) * 0.4, far, 1e-6);
    }
}
