//! Twin of `shaders/neighbours.wgsl`: fill the slots in ascending order of the numbers and bring the springs along.

use super::{BLOCK, by_slot};
use crate::{
    laws::{
        friction::{flag, inherit_spring, keep_spring},
        grid::search,
        precision::residue_of,
        walls::touch_wall,
    },
    model::Friction,
    state::{NONE, Packed, State},
};
use rayon::prelude::*;

pub fn neighbours(s: &mut State) {
    let needed = s.slot_start[s.sizes.bodies];
    s.counters[0].slots_needed = s.counters[0].slots_needed.max(needed);
    if needed as usize > s.neighbour.len() {
        s.halt[0] = 1; // the host will grow the lists and come back
        return;
    }
    let (mut neighbour, mut spring) = (std::mem::take(&mut s.neighbour), std::mem::take(&mut s.spring));
    let inherited: u32 = by_slot(&mut neighbour, s)
        .zip(by_slot(&mut spring, s))
        .enumerate()
        .map(|(k, (mut neighbour, mut spring))| {
            let bodies = k * BLOCK..((k + 1) * BLOCK).min(s.sizes.bodies);
            let of_body = |i| {
                let row;
                (row, neighbour) = std::mem::take(&mut neighbour).split_at_mut(s.row(i).len());
                fill(s, i, row);
                if s.model.friction == Friction::None {
                    return 0;
                }
                let springs;
                (springs, spring) = std::mem::take(&mut spring).split_at_mut(row.len());
                inherit(s, i, row, springs)
            };
            bodies.map(of_body).sum::<u32>()
        })
        .sum();
    (s.neighbour, s.spring) = (neighbour, spring);
    s.counters[0].inherited += inherited;
}

/// Grains near grain i in ascending order of their numbers, then walls, then NONE.
fn fill(s: &State, i: usize, row: &mut [u32]) {
    let here = &s.place[i];
    let fixed = s.motion[i].inverse_mass == 0.0;
    let mut filled = 0;
    search(s, i, s.params.margin, |j, near| {
        if let Some(entry) = row.get_mut(filled) {
            *entry = j as u32;
        }
        filled += usize::from(near);
    });
    row[..filled].sort_unstable_by_key(|&j| s.number[j as usize]);
    for w in 0..if fixed { 0 } else { s.sizes.walls } {
        if touch_wall(&s.wall[w], here, residue_of(s, i)).gap < s.params.margin {
            row[filled] = (s.sizes.bodies + w) as u32;
            filled += 1;
        }
    }
    row[filled..].fill(NONE);
}

/// Springs of grain i from the history; returns how many it counts.
fn inherit(s: &State, i: usize, row: &mut [u32], springs: &mut [Packed]) -> u32 {
    let mut inherited = 0;
    for (entry, spring) in row.iter_mut().zip(springs).take_while(|(entry, _)| **entry != NONE) {
        if let Some((f, mine)) = inherit_spring(s, i, *entry) {
            keep_spring(spring, f);
            flag(entry, true);
            inherited += u32::from(mine);
        }
    }
    inherited
}
