//! Twin of `shaders/neighbours/fill_across_levels.wgsl`: the pairs of two levels, on the lists of both.

use crate::{
    neighbours::{grid::pairs_across_levels, levels::entries_across},
    state::State,
};

pub fn fill_across_levels(s: &mut State) {
    if !s.lists_fit() {
        return;
    }
    for (i, j) in pairs_across_levels(s, |_| 0.0).into_iter().flatten() {
        list_across(s, i, j);
        list_across(s, j, i);
    }
}

/// Put j on the list of grain i.
fn list_across(s: &mut State, i: usize, j: usize) {
    let from_end = entries_across(s, i) - s.across_filled[i] as usize;
    let mut row = s.row(i);
    let entry = row.nth(row.len() - from_end).expect("they were counted");
    s.neighbour[entry] = j as u32;
    s.across_filled[i] += 1;
}
