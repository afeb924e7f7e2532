//! Twin of `shaders/extrapolate.wgsl`: velocities follow their momentum as impulses do, because they depend on them linearly.

use crate::state::{Motion, Spin, State};
use glam::DVec3;
use rayon::prelude::*;

pub fn extrapolate(s: &mut State) {
    let beta = s.relaxation[0].beta;
    let carried = |last: DVec3, before: DVec3| last + beta * (last - before);
    s.ahead.par_iter_mut().zip(&s.trial).zip(&s.trial_before).for_each(|((ahead, last), before)| {
        *ahead = Motion { v: carried(last.v, before.v), ..*last };
    });
    s.ahead_spin.par_iter_mut().zip(&s.trial_spin).zip(&s.trial_spin_before).for_each(|((ahead, last), before)| {
        *ahead = Spin(carried(last.0, before.0));
    });
}
