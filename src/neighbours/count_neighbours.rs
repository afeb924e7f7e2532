//! Twin of `shaders/neighbours/count_neighbours.wgsl`: how many entries each slice needs, and whether grains are on
//! the right side of every wall.

use crate::{
    neighbours::{
        grid::{counting_slack, search},
        levels::{entries_across, level_of},
    },
    space::{
        precision::position_low_of,
        walls::{is_crossed, wall_separation},
    },
    state::{HALTED, State},
};
use rayon::prelude::*;

pub fn count_neighbours(s: &mut State) {
    let mut list_start = std::mem::take(&mut s.list_start);
    let lost = list_start[..s.sizes.slices()]
        .par_iter_mut()
        .enumerate()
        .map(|(slice, entries)| {
            let (grains, lists) = s.sizes.lists_of_slice(slice);
            let mut lost = 0;
            for i in grains {
                let (besides, mark) = entries_besides(s, i);
                *entries = (near(s, i) + besides).max(*entries);
                lost = lost.max(mark);
            }
            *entries *= lists as u32;
            lost
        })
        .max()
        .unwrap_or(0);
    s.list_start = list_start;
    note_lost(s, lost);
}

/// Grains near grain i on its own level.
fn near(s: &State, i: usize) -> u32 {
    let reach = s.params.margin + counting_slack(&s.level[level_of(s, s.position[i].radius)]);
    let mut count = 0;
    search(s, i, reach, |_, near| count += u32::from(near));
    count
}

/// Entries of grain i for walls and for grains of other levels, and its mark if its centre is beyond a wall.
pub fn entries_besides(s: &State, i: usize) -> (u32, u32) {
    let here = &s.position[i];
    let (mut entries, mut crossed) = (entries_across(s, i) as u32, false);
    if s.velocity[i].inverse_mass != 0.0 {
        for wall in &s.wall[..s.sizes.walls] {
            let gap = wall_separation(wall, here, position_low_of(s, i)).gap;
            entries += u32::from(gap < 2.0 * s.params.margin);
            crossed |= is_crossed(s, gap, here.radius);
        }
    }
    (entries, if crossed { s.params.bodies - s.id[i] } else { 0 })
}

/// The mark of the first lost body, if there is one.
pub fn note_lost(s: &mut State, lost: u32) {
    s.counters[0].lost_body = s.counters[0].lost_body.max(lost);
    if lost != 0 {
        s.halt[0] = HALTED;
    }
}
