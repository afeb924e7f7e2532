//! Twin of `shaders/extrapolate.wgsl`: velocities follow their momentum as impulses do, because they depend on them linearly.

use crate::state::{Motion, Spin, State};

pub fn extrapolate(s: &mut State) {
    let beta = s.relaxation[0].beta;
    for i in 0..s.sizes.bodies {
        let (last, before) = (s.trial[i], s.trial_before[i]);
        s.ahead[i] = Motion { v: last.v + beta * (last.v - before.v), ..last };
        if let Some(ahead) = s.ahead_spin.get_mut(i) {
            let (last, before) = (s.trial_spin[i].0, s.trial_spin_before[i].0);
            *ahead = Spin(last + beta * (last - before));
        }
    }
}
