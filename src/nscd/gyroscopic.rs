//! Twin of `shaders/nscd/gyroscopic/`: what the spin of a free clump does in a step of contact dynamics.

use crate::{
    body::grains::{Clump, MAX_ITERATIONS, SpinIncrement, has_settled, own_spin},
    nscd::contact::free_spin_change,
    space::dimension::{all_equal, arm_increment, conjugate, largest, rotate, rotation_increment},
};
use crate::{model::Gyroscopic, state::State};
use glam::DVec3;

/// Change of the spin of a clump in the step if nothing touched it, along the axes of the scene. It is added up of
/// changes, because the difference of two spins loses its digits.
pub fn free_spin_change_of_clump(s: &State, here: &Clump) -> SpinIncrement {
    let damped = free_spin_change(s, &here.velocity, here.spin);
    if s.model.gyroscopic == Gyroscopic::Dropped || all_equal(s.model.dimension, here.inverse_moments) {
        return SpinIncrement { spin: damped, rounds: 0, settled: true };
    }
    let w = here.spin + damped;
    let momentum = rotate(here.orientation, own_spin(s, here, w) / here.inverse_moments);
    let mut free = SpinIncrement { spin: DVec3::ZERO, rounds: 0, settled: false };
    let mut moved = f64::INFINITY;
    while !free.settled && free.rounds < MAX_ITERATIONS {
        let turn = rotation_increment(0.25 * s.params.dt * (w + free.spin));
        // The momentum that stays, seen from the axes that turn; the spin that it gives, seen from the scene.
        let seen = arm_increment(conjugate(turn), momentum);
        let given = rotate(here.orientation, here.inverse_moments * rotate(conjugate(here.orientation), seen));
        let next = given + arm_increment(turn, w + given);
        let moved_before = moved;
        moved = largest(next - free.spin);
        free.settled = has_settled(s, moved, moved_before, next, w);
        free.spin = next;
        free.rounds += 1;
    }
    SpinIncrement { spin: free.spin + damped, ..free }
}
