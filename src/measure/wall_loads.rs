//! Twin of `shaders/measure/wall_loads.wgsl`: what free grains do to walls at step n, row by row.

use super::wall_sums::{Of, sum};
use crate::state::State;

pub fn wall_loads(s: &mut State) {
    sum(s, Of::All);
}
