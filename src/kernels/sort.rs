//! Twin of `shaders/sort.wgsl`: scatter the grains to their cells.

use crate::{
    laws::grid::{cell_index, cell_of},
    state::State,
};

pub fn sort(s: &mut State) {
    for i in 0..s.sizes.bodies {
        let begin = s.cell_start[cell_index(s, cell_of(s, s.place[i].x))];
        s.sorted[(begin + s.rank[i]) as usize] = i as u32;
    }
}
