//! Twin of `shaders/nscd/extrapolate.wgsl`: velocities follow their momentum as impulses do, because they depend on
//! them linearly.

use crate::state::{Spin, State, Velocity};
use glam::DVec3;
use rayon::prelude::*;

pub fn extrapolate(s: &mut State) {
    let beta = s.solver_state[0].beta;
    let carried = |last: DVec3, before: DVec3| last + beta * (last - before);
    s.extrapolated_velocity.par_iter_mut().zip(&s.pass_velocity).zip(&s.pass_velocity_before).for_each(
        |((extrapolated_velocity, last), before)| {
            *extrapolated_velocity = Velocity { v: carried(last.v, before.v), ..*last };
        },
    );
    s.extrapolated_spin.par_iter_mut().zip(&s.pass_spin).zip(&s.pass_spin_before).for_each(
        |((extrapolated_spin, last), before)| {
            *extrapolated_spin = Spin(carried(last.0, before.0));
        },
    );
}
