//! Twin of `shaders/neighbours/fill_neighbours.wgsl`: the neighbours on the level of each grain, in the order of the
//! cells.

use crate::{
    body::blocks::{BLOCK, by_entry},
    neighbours::{grid::search, levels::entries_across},
    state::{HALTED, NONE, State},
};
use rayon::prelude::*;

pub fn fill_neighbours(s: &mut State) {
    let needed = s.list_start[s.sizes.bodies];
    s.counters[0].entries_needed = s.counters[0].entries_needed.max(needed);
    if !s.lists_fit() {
        s.halt[0] = HALTED; // the host will grow the lists and come back
        return;
    }
    let mut neighbour = std::mem::take(&mut s.neighbour);
    by_entry(&mut neighbour, s).enumerate().for_each(|(k, mut neighbour)| {
        for i in k * BLOCK..((k + 1) * BLOCK).min(s.sizes.bodies) {
            let row;
            (row, neighbour) = std::mem::take(&mut neighbour).split_at_mut(s.row(i).len());
            let own = row.len() - entries_across(s, i);
            fill(s, i, &mut row[..own]);
        }
    });
    s.neighbour = neighbour;
}

/// Grains near grain i, then NONE.
fn fill(s: &State, i: usize, row: &mut [u32]) {
    let mut filled = 0;
    search(s, i, s.params.margin, |j, near| {
        if let Some(tagged) = row.get_mut(filled) {
            *tagged = j as u32;
        }
        filled += usize::from(near);
    });
    row[filled..].fill(NONE);
}
