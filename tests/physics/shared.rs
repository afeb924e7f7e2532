//! What the chapters share.

use crate::common::*;
use glam::DVec3;
use packstone::{
    scene::{Assembly, Grain, TimeStep},
    simulation::Simulation,
};

pub const INF: f64 = f64::INFINITY;

/// ω₀ of a default grain on a wall, 1/s.
pub fn omega(dimension: usize) -> f64 {
    (KN / mass(dimension, R)).sqrt()
}

/// Frequency of the tangential spring of a grain that sticks to the floor, 1/s.
pub fn stick_frequency(dimension: usize) -> f64 {
    ((1.0 + 1.0 / gyration(dimension)) * 2.0 / 7.0 * G / (1e-4 * R)).sqrt()
}

/// How a scene is run, besides as it stands: carried along, at a part of its step. To whoever goes with it the same
/// closed forms hold.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    pub velocity: DVec3,
    pub finer: u64,
}

/// The scene as it stands.
pub const AT_REST: Variant = Variant { velocity: DVec3::ZERO, finer: 1 };

/// At rest, and carried at 5 m/s, at a slant to the axes.
pub fn frames(dimension: usize) -> [Variant; 2] {
    let (sin, cos) = 0.7_f64.sin_cos();
    [AT_REST, Variant { velocity: 5.0 * (cos * DVec3::X + sin * up(dimension)), ..AT_REST }]
}

/// The same, each at the step of the scene and at a hundredth of it.
pub fn variants(dimension: usize) -> Vec<Variant> {
    let finer = |frame| [1, 100].map(|finer| Variant { finer, ..frame });
    frames(dimension).into_iter().flat_map(finer).collect()
}

impl Variant {
    pub fn start(&self, bench: &Bench, scene: &Assembly) -> Seen {
        assert_eq!(scene.solver.damping, 0.0, "global damping knows who is at rest");
        let mut scene = carried(scene, self.velocity);
        scene.solver.margin = 1.0; // for what it goes in a step
        let TimeStep::Fixed(dt) = &mut scene.solver.dt else { panic!("scenes here have a step") };
        *dt /= self.finer as f64;
        Seen { simulation: bench.start(&scene), variant: *self }
    }

    /// All grains after so many steps of the scene.
    pub fn after(&self, bench: &Bench, scene: &Assembly, steps: u64) -> Vec<Grain> {
        let mut seen = self.start(bench, scene);
        seen.advance(steps);
        seen.grains()
    }
}

/// A simulation as it is seen by whoever goes with it, in steps of its scene.
pub struct Seen {
    simulation: Simulation,
    variant: Variant,
}

impl Seen {
    pub fn advance(&mut self, steps: u64) {
        self.simulation.advance(steps * self.variant.finer).unwrap();
    }

    pub fn grains(&mut self) -> Vec<Grain> {
        let Variant { velocity, .. } = self.variant;
        let gone = self.simulation.time() * velocity;
        let seen = |g: Grain| Grain { position: g.position - gone, velocity: g.velocity - velocity, ..g };
        self.simulation.grains().unwrap().into_iter().map(seen).collect()
    }

    /// s
    pub fn time(&self) -> f64 {
        self.simulation.time()
    }
}
