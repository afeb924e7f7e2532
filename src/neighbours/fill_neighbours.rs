//! Twin of `shaders/neighbours/fill_neighbours.wgsl`: fill the lists in ascending order of the ids, and bring along
//! what contacts remember.

use crate::body::blocks::{BLOCK, by_entry};
use crate::{
    contact::history::{Restored, restore_history, restore_lanes, set_active},
    model::History,
    neighbours::grid::search,
    space::{precision::position_low_of, walls::wall_separation},
    state::{NONE, State},
};
use rayon::prelude::*;

pub fn fill_neighbours(s: &mut State) {
    let needed = s.list_start[s.sizes.bodies];
    s.counters[0].entries_needed = s.counters[0].entries_needed.max(needed);
    if needed as usize > s.neighbour.len() {
        s.halt[0] = 1; // the host will grow the lists and come back
        return;
    }
    let mut neighbour = std::mem::take(&mut s.neighbour);
    let restored: Vec<Vec<Restored>> = by_entry(&mut neighbour, s)
        .enumerate()
        .map(|(k, mut neighbour)| {
            let (mut restored, mut first) = (Vec::new(), 0);
            for i in k * BLOCK..((k + 1) * BLOCK).min(s.sizes.bodies) {
                let row;
                (row, neighbour) = std::mem::take(&mut neighbour).split_at_mut(s.row(i).len());
                fill(s, i, row);
                restore(s, i, row, first, &mut restored);
                first += row.len();
            }
            restored
        })
        .collect();
    s.neighbour = neighbour;
    s.counters[0].restored_contacts += restored.iter().flatten().filter(|contact| contact.same).count() as u32;
    restore_lanes(s, &restored);
}

/// Grains near grain i in ascending order of their numbers, then walls, then NONE.
fn fill(s: &State, i: usize, row: &mut [u32]) {
    let here = &s.position[i];
    let fixed = s.velocity[i].inverse_mass == 0.0;
    let mut filled = 0;
    search(s, i, s.params.margin, |j, near| {
        if let Some(tagged) = row.get_mut(filled) {
            *tagged = j as u32;
        }
        filled += usize::from(near);
    });
    row[..filled].sort_unstable_by_key(|&j| s.id[j as usize]);
    for w in 0..if fixed { 0 } else { s.sizes.walls } {
        if wall_separation(&s.wall[w], here, position_low_of(s, i)).gap < s.params.margin {
            row[filled] = (s.sizes.bodies + w) as u32;
            filled += 1;
        }
    }
    row[filled..].fill(NONE);
}

/// The contacts of grain i that the history has; its entries begin at `first`.
fn restore(s: &State, i: usize, row: &mut [u32], first: usize, restored: &mut Vec<Restored>) {
    if s.model.history == History::None {
        return;
    }
    for (entry, tagged) in (first..).zip(row).take_while(|(_, tagged)| **tagged != NONE) {
        if let Some((at, same)) = restore_history(s, i, *tagged) {
            set_active(tagged, true);
            restored.push(Restored { entry, at, same });
        }
    }
}
