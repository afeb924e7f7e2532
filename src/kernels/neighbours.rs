//! Twin of `shaders/neighbours.wgsl`: fill the slots with ids in ascending order and bring the springs along.

use super::rows;
use crate::{
    laws::{
        friction::{inherit_spring, springs_before},
        grid::candidates,
        touch::listed,
        walls::touch_wall,
    },
    model::Friction,
    state::{NONE, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn neighbours(s: &mut State) {
    s.counters[0].slots_needed = s.counters[0].slots_needed.max(s.slot_start[s.sizes.bodies]);
    if s.slot_start[s.sizes.bodies] as usize > s.neighbour.len() {
        return; // the host will grow the lists and come back
    }
    let mut neighbour = std::mem::take(&mut s.neighbour);
    let mut spring = std::mem::take(&mut s.spring);
    let lost: u32 = rows(&mut neighbour, &s.slot_start)
        .into_par_iter()
        .zip(rows(&mut spring, &s.slot_start))
        .enumerate()
        .map(|(i, (neighbour, spring))| {
            fill(s, i, neighbour);
            if s.model.friction == Friction::None { 0 } else { inherit(s, i, neighbour, spring) }
        })
        .sum();
    s.neighbour = neighbour;
    s.spring = spring;
    s.counters[0].lost += lost;
}

/// Ids of the grains and walls near grain i, ascending, then NONE.
fn fill(s: &State, i: usize, neighbour: &mut [u32]) {
    let here = &s.place[i];
    let fixed = s.motion[i].inverse_mass == 0.0;
    let near = candidates(s, here.x)
        .filter(|&j| j as usize != i && listed(s, here, &s.place[j as usize], 1.0))
        .filter(|&j| !(fixed && s.motion[j as usize].inverse_mass == 0.0));
    let walls = (0..if fixed { 0 } else { s.sizes.walls })
        .filter(|&w| touch_wall(&s.wall[w], here.x, DVec3::ZERO, here.radius).gap < s.params.margin)
        .map(|w| (s.sizes.bodies + w) as u32);
    let mut ids = near.chain(walls);
    neighbour.iter_mut().for_each(|slot| *slot = ids.next().unwrap_or(NONE));
    neighbour.sort_unstable();
}

/// Springs of grain i from the old lists; returns how many found no slot.
fn inherit(s: &State, i: usize, neighbour: &[u32], spring: &mut [DVec3]) -> u32 {
    let mut inherited = 0;
    for (&j, spring) in neighbour.iter().zip(spring) {
        *spring = inherit_spring(s, i, j);
        inherited += u32::from(*spring != DVec3::ZERO);
    }
    springs_before(s, i).saturating_sub(inherited)
}
