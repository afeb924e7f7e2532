//! Twin of `shaders/nscd/coloring/assign_colors.wgsl`: contacts that both grains have named get the first colour that
//! neither has, and a place among those of the colour.

use crate::{
    body::grains::members,
    nscd::contact::{entry_of, list_entries},
    state::{ContactColor, INDEX, NONE, State},
};
use rayon::prelude::*;

pub fn assign_colors(s: &mut State) {
    s.coloring_state[0].uncolored = 0;
    let agreed = |&i: &usize| match s.proposal[i] {
        NONE => false,
        j => s.proposal.get(j as usize).is_none_or(|&answer| answer as usize == i),
    };
    let grains = (0..s.sizes.bodies).into_par_iter().filter(agreed);
    let colors: Vec<(usize, u32)> = grains.map(|i| (i, color_of(s, i))).collect();
    for (i, color) in colors {
        let j = s.proposal[i] as usize;
        s.coloring_state[0].colors = s.coloring_state[0].colors.max(color);
        let mut rank = 0;
        // Of a colour too many nobody counts the contacts; the host makes room, and begins again.
        if let Some(color_count) = s.color_count.get_mut(color as usize - 1).filter(|_| i < j) {
            rank = *color_count;
            *color_count += 1;
            s.coloring_state[0].contacts += 1;
        }
        let entry = entry_of(s, i, j);
        s.contact_color[entry] = ContactColor { color, rank };
    }
}

/// The first colour that is free at both grains of the contact that body i has named.
fn color_of(s: &State, i: usize) -> u32 {
    let j = s.proposal[i] as usize;
    let others = |i: usize, j: usize| {
        let entries = members(s, i).flat_map(move |member| list_entries(s, member).map(move |entry| (member, entry)));
        entries
            .filter(move |&(member, entry)| member != i || (s.neighbour[entry] & INDEX) as usize != j)
            .map(|(_, entry)| entry)
    };
    let mut taken: Vec<u32> = others(i, j).map(|entry| s.contact_color[entry].color).collect();
    if j < s.sizes.bodies {
        taken.extend(others(j, i).map(|entry| s.contact_color[entry].color));
    }
    (1..).find(|color| !taken.contains(color)).expect("there are more colours than contacts of two grains")
}
