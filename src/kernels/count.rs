//! Twin of `shaders/count.wgsl`: how many slots each grain needs, and whether it is on the right side of every wall.

use crate::{
    laws::{grid::candidates, touch::listed, walls::touch_wall},
    state::State,
};
use glam::DVec3;
use rayon::prelude::*;

pub fn count(s: &mut State) {
    let mut slot_start = std::mem::take(&mut s.slot_start);
    let bad = (&mut slot_start[..s.sizes.bodies])
        .into_par_iter()
        .enumerate()
        .map(|(i, slots)| {
            let (needed, crossed) = slots_of(s, i);
            *slots = needed;
            if crossed { (s.sizes.bodies - i) as u32 } else { 0 }
        })
        .max();
    s.slot_start = slot_start;
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad.unwrap_or(0));
}

/// Slots of grain i, and whether its centre is beyond a wall.
fn slots_of(s: &State, i: usize) -> (u32, bool) {
    let here = &s.place[i];
    let fixed = s.motion[i].inverse_mass == 0.0;
    let mut slots = candidates(s, here.x)
        .filter(|&j| j as usize != i && listed(s, here, &s.place[j as usize], 1.00001))
        .filter(|&j| !(fixed && s.motion[j as usize].inverse_mass == 0.0))
        .count() as u32;
    let mut crossed = false;
    if !fixed {
        for wall in &s.wall[..s.sizes.walls] {
            let gap = touch_wall(wall, here.x, DVec3::ZERO, here.radius).gap;
            slots += u32::from(gap < 2.0 * s.params.margin);
            crossed |= gap < -here.radius;
        }
    }
    (slots, crossed)
}
