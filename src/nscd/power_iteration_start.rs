//! Twin of `shaders/nscd/power_iteration_start.wgsl`: velocities that hide from no mode, for a power iteration.

use crate::{
    nscd::{contact::impulse_inverse_mass, response::grain_of},
    state::{Spin, State, Velocity},
    units::Quantity,
};
use glam::DVec3;

pub fn power_iteration_start(s: &mut State) {
    (s.solver_state[0].lipschitz, s.solver_state[0].beta) = (0.0, 0.0);
    let unit = s.units.of(Quantity::Velocity);
    for i in 0..s.sizes.bodies {
        let inverse_mass = impulse_inverse_mass(s, i);
        let mut v = DVec3::ZERO;
        if inverse_mass != 0.0 {
            // One of two directions along every axis, by the bits of a scrambled number.
            let mut bits = (grain_of(s, i) + 1).wrapping_mul(2_654_435_769);
            bits = (bits ^ (bits >> 15)).wrapping_mul(2_246_822_519);
            bits ^= bits >> 13;
            for axis in 0..s.model.dims() {
                v[axis] = if (bits >> axis) & 1 == 0 { unit } else { -unit };
            }
        }
        s.extrapolated_velocity[i] = Velocity { v, inverse_mass };
        if let Some(spin) = s.extrapolated_spin.get_mut(i) {
            *spin = Spin::default();
        }
    }
}
