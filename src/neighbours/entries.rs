//! Twin of `shaders/neighbours/entries.wgsl`: lists in ascending order of the ids, and what comes behind the grains.

use crate::body::blocks::{BLOCK, by_entry, first_entry};
use crate::{
    contact::history::{Restored, restore_history, restore_lanes, set_active},
    model::History,
    neighbours::levels::{entries_across, filled_across},
    space::{precision::position_low_of, walls::wall_separation},
    state::{NONE, State},
};
use rayon::prelude::*;
use std::ops::Range;

/// Order the lists of these grains, and bring along what contacts remember.
pub fn order(s: &mut State, bodies: Range<usize>) {
    if !s.lists_fit() {
        return;
    }
    let mut neighbour = std::mem::take(&mut s.neighbour);
    let restored: Vec<Vec<Restored>> = by_entry(&mut neighbour, s)
        .enumerate()
        .map(|(k, neighbour)| {
            let (mut restored, mut list, mut keys) = (Vec::new(), Vec::new(), Vec::new());
            let first = k * BLOCK;
            let begin = first_entry(s, first);
            for i in bodies.start.max(first)..bodies.end.min(first + BLOCK) {
                let row = s.row(i).from(begin);
                list.clear();
                list.extend(row.clone().map(|entry| neighbour[entry]));
                order_list(s, i, &mut list, &mut keys);
                restore(s, i, &mut list, row.clone(), &mut restored);
                row.zip(&list).for_each(|(entry, tagged)| neighbour[entry] = *tagged);
            }
            restored
        })
        .collect();
    s.neighbour = neighbour;
    s.counters[0].restored_contacts += restored.iter().flatten().filter(|contact| contact.same).count() as u32;
    restore_lanes(s, &restored);
}

/// Grains near grain i in ascending order of their ids, but no pairs of fixed grains, then walls, then NONE.
fn order_list(s: &State, i: usize, row: &mut [u32], keys: &mut Vec<u64>) {
    let fixed = |i: usize| s.velocity[i].inverse_mass == 0.0;
    let unfilled = entries_across(s, i) - filled_across(s, i);
    let mut filled = 0;
    for entry in 0..row.len() - unfilled {
        let j = row[entry];
        if j != NONE && !(fixed(i) && fixed(j as usize)) {
            row[filled] = j;
            filled += 1;
        }
    }
    // Numbers are looked up once, and are sorted together with what they are of.
    keys.clear();
    keys.extend(row[..filled].iter().map(|&j| u64::from(s.id[j as usize]) << 32 | u64::from(j)));
    keys.sort_unstable();
    row.iter_mut().zip(&*keys).for_each(|(entry, key)| *entry = *key as u32);
    for w in 0..if fixed(i) { 0 } else { s.sizes.walls } {
        if wall_separation(&s.wall[w], &s.position[i], position_low_of(s, i)).gap < s.params.margin {
            row[filled] = (s.sizes.bodies + w) as u32;
            filled += 1;
        }
    }
    row[filled..].fill(NONE);
}

/// The contacts of grain i that the history has; `row` are the entries of its list.
fn restore(s: &State, i: usize, list: &mut [u32], row: impl Iterator<Item = usize>, restored: &mut Vec<Restored>) {
    if s.model.history == History::None {
        return;
    }
    for (entry, tagged) in row.zip(list).take_while(|(_, tagged)| **tagged != NONE) {
        if let Some((at, same)) = restore_history(s, i, *tagged) {
            set_active(tagged, true);
            restored.push(Restored { entry, at, same });
        }
    }
}
