//! Twin of `shaders/sort.wgsl`: scatter the grains to their cells.

use super::cells;
use crate::state::State;

pub fn sort(s: &mut State) {
    for (i, c) in cells(s).into_iter().enumerate() {
        s.sorted[(s.cell_start[c] + s.rank[i]) as usize] = i as u32;
    }
}
