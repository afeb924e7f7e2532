//! A run that goes on from a checkpoint is the run that was never interrupted, to the bit.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/place.rs"]
mod place;

mod checkpoints;
mod doubts;
mod from;
mod kills;

use packstone::scene::{Assembly, Scene};
use std::path::Path;

fn example(name: &str, set: &[&str]) -> Assembly {
    let set: Vec<String> = set.iter().map(|set| (*set).to_owned()).collect();
    Scene::load(&Path::new("examples/scenes").join(name), &set).unwrap().assemble().unwrap()
}

/// A part of the bed of dimers that collide soon, and of the box of 10,000 disks, as crowded as the whole.
const FEW_DIMERS: [&str; 3] =
    ["population.0.count=500", "domain.upper=[0.01, 0.01, 1]", "population.0.velocity_spread=0.3"];
const FEW_DISKS: [&str; 4] = [
    "population.0.count=10",
    "population.1.count=990",
    "wall.0.upper=[0.04, 2]",
    "population.0.region.upper=[0.04, 0.2]",
];

fn rigid_clumps(solver: &str) -> Assembly {
    let solver = format!("solver.relaxation={solver}");
    let set = ["solver.method=cd", "solver.dt=2e-4", "solver.max_iterations=20", &solver];
    example("hard/dimer_bed.toml", &[&set[..], &FEW_DIMERS].concat())
}

const SETTLE: &str = r#"
dimension = 2
seed = 3
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.5
restitution = 0.3
[[wall]]
kind = "box"
name = "bin"
material = "glass"
lower = [0, 0]
upper = [0.02, 1]
faces = ["x-", "x+", "y-"]
[[wall]]
kind = "plane"
name = "lid"
material = "glass"
point = [0, 0.1]
normal = [0, -1]
velocity = [0, -0.1]
[[population]]
material = "glass"
count = 100
radius = { uniform = [0.8e-3, 1.2e-3] }
[solver]
damping = 20
[stop]
time = 0.2
"#;
