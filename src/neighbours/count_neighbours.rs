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
    let bad = list_start[..s.sizes.slices()]
        .par_iter_mut()
        .enumerate()
        .map(|(slice, entries)| {
            let (grains, lists) = s.sizes.lists_of_slice(slice);
            let mut bad = 0;
            for i in grains {
                let (needed, crossed) = entries_of(s, i);
                *entries = needed.max(*entries);
                bad = bad.max(if crossed { s.params.bodies - s.id[i] } else { 0 });
            }
            *entries *= lists as u32;
            bad
        })
        .max()
        .unwrap_or(0);
    s.list_start = list_start;
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
    if bad != 0 {
        s.halt[0] = HALTED;
    }
}

/// Entries of grain i, and whether its centre is beyond a wall.
fn entries_of(s: &State, i: usize) -> (u32, bool) {
    let here = &s.position[i];
    let fixed = s.velocity[i].inverse_mass == 0.0;
    let reach = s.params.margin + counting_slack(&s.level[level_of(s, here.radius)]);
    let mut entries = entries_across(s, i) as u32;
    search(s, i, reach, |_, near| entries += u32::from(near));
    let mut crossed = false;
    if !fixed {
        for wall in &s.wall[..s.sizes.walls] {
            let gap = wall_separation(wall, here, position_low_of(s, i)).gap;
            entries += u32::from(gap < 2.0 * s.params.margin);
            crossed |= is_crossed(s, gap, here.radius);
        }
    }
    (entries, crossed)
}
