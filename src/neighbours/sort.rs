//! Twin of `shaders/neighbours/sort.wgsl`: scatter the grains to their cells.

use crate::neighbours::grid::cells;
use crate::state::State;

pub fn sort(s: &mut State) {
    for (i, c) in cells(s).into_iter().enumerate() {
        s.sorted[(s.cell_start[c] + s.cell_rank[i]) as usize] = i as u32;
    }
}
