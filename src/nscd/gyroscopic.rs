//! Twin of `shaders/nscd/gyroscopic/`: what the spin of a free clump does in a step of contact dynamics.

use crate::{
    body::grains::{Clump, MAX_ITERATIONS, own_spin},
    nscd::contact::free_spin,
    space::{
        dimension::{all_equal, conjugate, largest, quaternion_product, rotate, rotation_increment},
        precision::spin_tolerance,
    },
};
use crate::{model::Gyroscopic, state::State};
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
    let mut freed = Freed { spin: free_spin(s, &here.velocity, here.spin), rounds: 0, settled: true };
    if s.model.gyroscopic == Gyroscopic::Dropped || all_equal(s.model.dimension, here.inverse_moments) {
        return freed;
    }
    let momentum = rotate(here.orientation, own_spin(s, here, freed.spin) / here.inverse_moments);
    freed.settled = false;
    while !freed.settled && freed.rounds < MAX_ITERATIONS {
        let q = here.orientation
            + quaternion_product(rotation_increment(0.25 * s.params.dt * freed.spin), here.orientation);
        let next = rotate(q, here.inverse_moments * rotate(conjugate(q), momentum));
        freed.settled = !(largest(next - freed.spin) > spin_tolerance(s) * largest(next));
        freed.spin = next;
        freed.rounds += 1;
    }
    freed
}
