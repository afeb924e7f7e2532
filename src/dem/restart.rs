//! Twin of `shaders/dem/restart.wgsl`: adaptive damping 2, momentum is dropped where forces have not done positive work.

use crate::state::{HALTED, State};

pub fn restart(s: &mut State) {
    if s.halt[0] < HALTED {
        let gains = s.energy_gain.iter().sum::<f64>() > 0.0;
        s.steps_since_restart[0] = if gains { s.steps_since_restart[0].wrapping_add(1) } else { 0 };
    }
}
