//! Twin of `shaders/conclude.wgsl`: the judgement, for the host.

use crate::{laws::rigid::total, state::State};

pub fn conclude(s: &mut State) {
    let sum = total(s);
    let relaxation = &mut s.relaxation[0];
    relaxation.residual = sum.residual.sqrt() / relaxation.scale;
    relaxation.late = sum.late;
    if sum.late > 0 {
        // With more contacts the residual begins anew.
        (relaxation.lowest, relaxation.lowest_at) = (1e30, relaxation.passes);
    }
    relaxation.excess = sum.excess.max(0.0) / sum.pressing.max(1e-36);
}
