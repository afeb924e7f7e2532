//! Twin of `shaders/neighbours/bin.wgsl`: histogram of grains over cells, and each grain's rank inside its cell.

use crate::neighbours::grid::cells;
use crate::state::State;

pub fn bin(s: &mut State) {
    for (i, c) in cells(s).into_iter().enumerate() {
        s.cell_rank[i] = s.cell_start[c];
        s.cell_start[c] += 1;
    }
}
