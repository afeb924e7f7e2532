//! Twin of `shaders/gauge.wgsl`: Rayleigh's quotient, from below, with a margin.

use crate::{laws::rigid::total, state::State};

pub fn gauge(s: &mut State) {
    let sum = total(s);
    if sum.work > 0.0 {
        let stretch = &mut s.relaxation[0].stretch;
        *stretch = stretch.max(1.02 * sum.way / sum.work);
    }
}
