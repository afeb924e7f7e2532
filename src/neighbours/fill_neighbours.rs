//! Twin of `shaders/neighbours/fill_neighbours.wgsl`: the neighbours on the level of each grain, in the order of the
//! cells.

use crate::{
    body::blocks::{BLOCK, by_entry, first_entry},
    neighbours::{grid::search, levels::entries_across},
    state::{HALTED, NONE, State},
};
use rayon::prelude::*;

pub fn fill_neighbours(s: &mut State) {
    fill_lists(s, fill);
}

/// Fill lists by a function that says how many of its entries it has used.
pub fn fill_lists(s: &mut State, fill: impl Fn(&State, usize, &mut [u32]) -> usize + Sync) {
    let needed = s.all_entries() as u32;
    s.counters[0].entries_needed = s.counters[0].entries_needed.max(needed);
    if !s.lists_fit() {
        s.halt[0] = HALTED; // the host will grow the lists and come back
        return;
    }
    let mut neighbour = std::mem::take(&mut s.neighbour);
    by_entry(&mut neighbour, s).enumerate().for_each(|(k, neighbour)| {
        let (first, mut list) = (k * BLOCK, Vec::new());
        let begin = first_entry(s, first);
        for i in first..(first + BLOCK).min(s.sizes.bodies) {
            let row = s.row(i).from(begin);
            list.resize(row.len() - entries_across(s, i), NONE);
            let filled = fill(s, i, &mut list);
            list[filled..].fill(NONE);
            row.zip(&list).for_each(|(entry, j)| neighbour[entry] = *j);
        }
    });
    s.neighbour = neighbour;
}

/// Grains near grain i.
fn fill(s: &State, i: usize, list: &mut [u32]) -> usize {
    let mut filled = 0;
    search(s, i, s.params.margin, |j, near| {
        if let Some(tagged) = list.get_mut(filled) {
            *tagged = j as u32;
        }
        filled += usize::from(near);
    });
    filled
}
