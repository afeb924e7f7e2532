//! Twin of `shaders/nscd/move_members.wgsl`: members follow from where their clumps are.

use crate::dem::place_members::place_all_members;
use crate::state::{HALTED, State};

pub fn move_members(s: &mut State) {
    if place_all_members(s) {
        s.halt[0] = HALTED; // the host will take the step back, and walls must not have moved
    }
}
