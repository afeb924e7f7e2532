//! Twin of `shaders/displace_members.wgsl`: members follow from where their clumps are.

use super::carry::follow_clumps;
use crate::state::State;

pub fn displace_members(s: &mut State) {
    if follow_clumps(s) {
        s.halt[0] = 1; // the host will take the step back, and walls must not have moved
    }
}
