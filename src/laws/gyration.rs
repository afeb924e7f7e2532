//! Twin of `shaders/gyration/`: what the spin of a free clump does in a step of contact dynamics.

use super::{
    dimension::{all_equal, attitude_gain, conjugate, largest, product, turned},
    grains::{Clump, MOST_ROUNDS, own_spin},
    precision::spin_tolerance,
    rigid::freed_spin,
};
use crate::{model::Gyration, state::State};
use glam::DVec3;

/// A clump's spin, rad/s along the axes of the scene, and how it was found.
#[derive(Clone, Copy, Debug)]
pub struct Freed {
    pub spin: DVec3,
    pub rounds: u32,
    pub settled: bool,
}

/// Spin of a clump at the end of the step if nothing touched it.
pub fn free_spin_of_clump(s: &State, here: &Clump) -> Freed {
    let mut freed = Freed { spin: freed_spin(s, &here.motion, here.spin), rounds: 0, settled: true };
    if s.model.gyration == Gyration::Dropped || all_equal(s.model.dimension, here.inverse_moments) {
        return freed;
    }
    let momentum = turned(here.attitude, own_spin(s, here, freed.spin) / here.inverse_moments);
    freed.settled = false;
    while !freed.settled && freed.rounds < MOST_ROUNDS {
        let q = here.attitude + product(attitude_gain(0.25 * s.params.dt * freed.spin), here.attitude);
        let next = turned(q, here.inverse_moments * turned(conjugate(q), momentum));
        freed.settled = !(largest(next - freed.spin) > spin_tolerance(s) * largest(next));
        freed.spin = next;
        freed.rounds += 1;
    }
    freed
}
