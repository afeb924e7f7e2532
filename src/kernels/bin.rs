//! Twin of `shaders/bin.wgsl`: histogram of grains over cells, and each grain's rank inside its cell.

use super::cells;
use crate::state::State;

pub fn bin(s: &mut State) {
    for (i, c) in cells(s).into_iter().enumerate() {
        s.rank[i] = s.cell_start[c];
        s.cell_start[c] += 1;
    }
}
