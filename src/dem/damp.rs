//! Twin of `shaders/dem/damp.wgsl`: adaptive damping 3, what of the velocities is left for the next step.

use crate::state::{HALTED, State, VelocityLow};

pub fn damp(s: &mut State) {
    // The host tells by its speed why a grain is lost.
    if s.halt[0] >= HALTED || s.counters[0].lost_body > 0 {
        return;
    }
    let steps = f64::from(s.steps_since_restart[0]);
    let left = steps / (steps + 3.0);
    for (i, next) in s.velocity_next.iter_mut().enumerate().filter(|(_, next)| next.inverse_mass != 0.0) {
        next.v *= left;
        if let Some(spin) = s.spin_next.get_mut(i) {
            spin.0 *= left;
        }
        if let Some(low) = s.velocity_low_next.get_mut(i) {
            *low = VelocityLow::default();
        }
    }
}
