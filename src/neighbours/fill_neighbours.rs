//! Twin of `shaders/neighbours/fill_neighbours.wgsl`: fill the slots in ascending order of the numbers and bring the springs along.

use crate::body::blocks::{BLOCK, by_entry};
use crate::{
    contact::history::{keep_spring, restore_history, set_active},
    model::Tangential,
    neighbours::grid::search,
    space::{precision::position_low_of, walls::wall_separation},
    state::{NONE, Packed, State},
};
use rayon::prelude::*;

pub fn fill_neighbours(s: &mut State) {
    let needed = s.list_start[s.sizes.bodies];
    s.counters[0].entries_needed = s.counters[0].entries_needed.max(needed);
    if needed as usize > s.neighbour.len() {
        s.halt[0] = 1; // the host will grow the lists and come back
        return;
    }
    let (mut neighbour, mut spring) = (std::mem::take(&mut s.neighbour), std::mem::take(&mut s.spring));
    let restored: u32 = by_entry(&mut neighbour, s)
        .zip(by_entry(&mut spring, s))
        .enumerate()
        .map(|(k, (mut neighbour, mut spring))| {
            let bodies = k * BLOCK..((k + 1) * BLOCK).min(s.sizes.bodies);
            let of_body = |i| {
                let row;
                (row, neighbour) = std::mem::take(&mut neighbour).split_at_mut(s.row(i).len());
                fill(s, i, row);
                if s.model.tangential == Tangential::None {
                    return 0;
                }
                let springs;
                (springs, spring) = std::mem::take(&mut spring).split_at_mut(row.len());
                restore(s, i, row, springs)
            };
            bodies.map(of_body).sum::<u32>()
        })
        .sum();
    (s.neighbour, s.spring) = (neighbour, spring);
    s.counters[0].restored_contacts += restored;
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

/// Springs of grain i from the history; returns how many it counts.
fn restore(s: &State, i: usize, row: &mut [u32], springs: &mut [Packed]) -> u32 {
    let mut restored = 0;
    for (tagged, spring) in row.iter_mut().zip(springs).take_while(|(tagged, _)| **tagged != NONE) {
        if let Some((f, mine)) = restore_history(s, i, *tagged) {
            keep_spring(spring, f);
            set_active(tagged, true);
            restored += u32::from(mine);
        }
    }
    restored
}
