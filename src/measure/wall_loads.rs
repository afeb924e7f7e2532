//! Twin of `shaders/measure/wall_loads.wgsl`: what free grains do to walls at step n, row by row.

use super::wall_sums::add_up;
use crate::state::State;

pub fn wall_loads(s: &mut State) {
    add_up(s, |_, _| true);
}
