//! Scenes of the cases, and what is done to them.

use crate::{
    scene::{Assembly, Dashpot, Method, Relaxation, Scene, TimeStep},
    simulation::Simulation,
};
use std::path::{Path, PathBuf};

/// The scenes of the cases. They are read from the source tree.
pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes/hard")
}

/// A scene of the folder.
pub fn scene(name: &str) -> Assembly {
    changed_scene(name, &[])
}

/// The same with `--set`.
pub fn changed_scene(name: &str, set: &[&str]) -> Assembly {
    let path = folder().join(format!("{name}.toml"));
    let set: Vec<String> = set.iter().map(|s| (*s).to_owned()).collect();
    Scene::load(&path, &set).and_then(|scene| scene.assemble()).unwrap_or_else(|e| panic!("{e}"))
}

/// How a scene of rigid grains is solved.
pub fn relaxation(scene: &mut Assembly) -> &mut Relaxation {
    match &mut scene.solver.method {
        Method::ContactDynamics(relaxation) => relaxation,
        Method::DiscreteElements => panic!("a scene of rigid grains"),
    }
}

/// Rigid grains, solved to this tolerance.
pub fn solved_to(mut scene: Assembly, tolerance: f64) -> Assembly {
    relaxation(&mut scene).tolerance = tolerance;
    scene
}

/// The grains of a rigid scene with springs, k_T = 2/7 k_N, and global damping.
pub fn compliant(rigid: &Assembly, stiffness: f64, dt: f64, damping: f64) -> Assembly {
    let mut scene = rigid.clone();
    for pair in &mut scene.pairs {
        (pair.normal_stiffness, pair.tangential_stiffness) = (stiffness, 2.0 / 7.0 * stiffness);
        pair.dashpot = Dashpot::None;
    }
    scene.solver.method = Method::DiscreteElements;
    (scene.solver.dt, scene.solver.damping, scene.solver.margin) = (TimeStep::Fixed(dt), damping, 0.2);
    scene
}

/// Loads on the contacts of a column, from the lowest up, N: what the contacts of all grains above add up to.
pub fn loads(simulation: &mut Simulation) -> Vec<f64> {
    let held = simulation.forces().unwrap();
    let mut loads: Vec<f64> = held
        .iter()
        .rev()
        .scan(0.0, |sum, (force, _)| {
            *sum += force.z;
            Some(*sum)
        })
        .collect();
    loads.reverse();
    loads
}
