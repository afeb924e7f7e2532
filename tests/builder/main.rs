//! Scenes in code: the same scenes as files, refused in the same words; assemblies made by hand are checked as well.

mod by_hand;
mod files;
mod refused;

use packstone::prelude::*;

fn glass() -> MaterialBuilder {
    MaterialBuilder::new(2500.0).normal_stiffness(1e5).friction(0.3).restitution(0.81)
}

fn steel() -> MaterialBuilder {
    MaterialBuilder::new(7800.0).normal_stiffness(3e5).tangential_stiffness(1e5).friction(0.5)
}

/// Two materials and a stop.
fn base(dimension: usize) -> SceneBuilder {
    Scene::builder(dimension).material("glass", glass()).material("steel", steel()).stop_steps(10)
}

fn bead() -> GrainBuilder {
    GrainBuilder::new("glass", [0.0, 0.0, 1.0], 0.1)
}

/// `base` in a file.
const BASE: &str = r#"
dimension = 3
stop.steps = 10
[material.glass]
density = 2500
normal_stiffness = 1e5
friction = 0.3
restitution = 0.81
[material.steel]
density = 7800
normal_stiffness = 3e5
tangential_stiffness = 1e5
friction = 0.5
"#;

/// `bead` in a file.
const BEAD: &str = "[[grain]]\nposition = [0, 0, 1]\nradius = 0.1\nmaterial = \"glass\"\n";

/// A file that messages call `scene`, as they do a builder's.
fn file(text: &str) -> packstone::Result<Assembly> {
    Scene::parse(text, "scene", ".".as_ref(), &[])?.assemble()
}

fn message<T>(outcome: packstone::Result<T>) -> String {
    match outcome {
        Err(Error::Scene(message)) => message,
        Err(other) => panic!("not a scene error: {other}"),
        Ok(_) => panic!("accepted"),
    }
}
