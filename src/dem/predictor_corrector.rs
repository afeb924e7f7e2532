//! Twin of `shaders/dem/predictor_corrector.wgsl`: rotation of clumps in the discrete element method, (2.21)-(2.32).

use crate::state::State;
use crate::{
    body::{
        grains::{Clump, MAX_ITERATIONS, SpinIncrement, has_settled, spins_in_scene},
        rotation::{spin_change, spin_change_to_step},
    },
    space::dimension::{conjugate, gyroscopic, largest, rotate},
};
use glam::DVec3;

/// Angular acceleration (2.21)-(2.23) without damping, rad/s².
pub fn spin_acceleration(s: &State, here: &Clump, w: DVec3, torque: DVec3) -> DVec3 {
    here.inverse_moments * (torque + gyroscopic(s.model.dimension, w, here.inverse_moments))
}

/// Rounds of predictor and corrector (2.24)-(2.31), until Δω has settled. The torque is along the principal axes. Damping
/// is solved for, as in (2.19), so that the iteration has to find the products of ω alone.
pub fn predictor_corrector(s: &State, here: &Clump, torque: DVec3, before: DVec3) -> SpinIncrement {
    let gain_at = |w: DVec3| spin_change(s, here.spin, spin_acceleration(s, here, w, torque));
    let (mut gain, mut rounds, mut settled, mut moved) = (before, 0, false, f64::INFINITY);
    while !settled && rounds < MAX_ITERATIONS {
        let predicted = gain_at(here.spin + 0.5 * gain);
        gain = gain_at(here.spin + 0.5 * predicted);
        rounds += 1;
        let moved_before = moved;
        moved = largest(gain - predicted);
        settled = has_settled(s, moved, moved_before, gain, here.spin);
    }
    SpinIncrement { spin: gain, rounds, settled }
}

/// The moment along the axes in which the clump spins.
pub fn own_torque(here: &Clump, torque: DVec3) -> DVec3 {
    rotate(conjugate(here.orientation), torque)
}

/// Change of the spin to step n, rad/s, in the axes in which the clump spins; the torque is along those of the scene.
pub fn clump_spin_change_now(s: &State, c: usize, here: &Clump, torque: DVec3) -> DVec3 {
    if !spins_in_scene(&s.model, here.inverse_moments) {
        return 0.5 * predictor_corrector(s, here, own_torque(here, torque), s.spin_increment[c].0).spin;
    }
    if here.velocity.inverse_mass == 0.0 {
        return DVec3::ZERO;
    }
    spin_change_to_step(s, here.spin, here.inverse_moments * torque)
}
