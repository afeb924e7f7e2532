//! Twin of `shaders/set_out.wgsl`: the relaxation of a step begins.

use crate::{
    laws::rigid::total,
    state::{Relaxation, State},
};

pub fn set_out(s: &mut State) {
    let sum = total(s);
    let scale = sum.reference.max(sum.least).sqrt().max(sum.imposed).max(1e-30);
    let stretch = s.relaxation[0].stretch.max(1.0);
    s.relaxation[0] = Relaxation {
        scale,
        crowd: sum.crowd,
        stretch,
        theta: 1.0,
        best: 1e30,
        lowest: 1e30,
        shorter: 1.0,
        ..Relaxation::default()
    };
}
