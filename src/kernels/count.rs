//! Twin of `shaders/count.wgsl`: how many slots each grain needs, and whether it is on the right side of every wall.

use crate::{
    laws::{grains::same_grain, grid::for_candidates, precision::residue_of, touch::within, walls::touch_wall},
    state::State,
};
use rayon::prelude::*;

pub fn count(s: &mut State) {
    let mut slot_start = std::mem::take(&mut s.slot_start);
    let (last, bodies) = slot_start.split_last_mut().expect("one more than there are grains");
    *last = 0;
    let bad = bodies
        .par_iter_mut()
        .enumerate()
        .map(|(i, slots)| {
            let (needed, crossed) = slots_of(s, i);
            *slots = needed;
            if crossed { s.params.bodies - s.number[i] } else { 0 }
        })
        .max()
        .unwrap_or(0);
    s.slot_start = slot_start;
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    s.halt[0] = s.halt[0].max(u32::from(bad != 0));
}

/// Slots of grain i, and whether its centre is beyond a wall.
fn slots_of(s: &State, i: usize) -> (u32, bool) {
    let here = &s.place[i];
    let fixed = s.motion[i].inverse_mass == 0.0;
    let reach = s.params.margin + 1e-5 * here.radius;
    let mut slots = 0;
    for_candidates(s, here.x, |j| slots += u32::from(within(s, here, &s.place[j], reach) & !same_grain(s, i, j)));
    let mut crossed = false;
    if !fixed {
        for wall in &s.wall[..s.sizes.walls] {
            let gap = touch_wall(wall, here, residue_of(s, i)).gap;
            slots += u32::from(gap < 2.0 * s.params.margin);
            crossed |= gap < -here.radius;
        }
    }
    (slots, crossed)
}
