//! Twin of `shaders/bin.wgsl`: histogram of grains over cells, and each grain's rank inside its cell.

use crate::{
    laws::grid::{cell_index, cell_of},
    state::State,
};

pub fn bin(s: &mut State) {
    for i in 0..s.sizes.bodies {
        let c = cell_index(s, cell_of(s, s.place[i].x));
        s.rank[i] = s.cell_start[c];
        s.cell_start[c] += 1;
    }
}
