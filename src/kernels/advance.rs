//! Twin of `shaders/advance.wgsl`: contact forces at step n, then leapfrog: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).

use super::{by_body, by_slot};
use crate::{
    laws::{
        boundary::wrapped,
        contact::{Body, Gathered, body, contact_of, near},
        dimension::outside,
        friction::{forget_spring, keep_spring, spring_of},
        leapfrog::advanced,
        precision::moved,
        rotation::advanced_spin,
    },
    state::{INDEX, Motion, NONE, Packed, Place, Residue, Spin, State},
};
use rayon::prelude::*;
use std::mem::take;

/// What a task writes: a run of grains, and their slots.
struct Block<'a> {
    place: &'a mut [Place],
    residue: &'a mut [Residue],
    motion: &'a mut [Motion],
    spin: &'a mut [Spin],
    travel: &'a mut [f64],
    neighbour: &'a mut [u32],
    spring: &'a mut [Packed],
}

pub fn advance(s: &mut State) {
    if s.halt[0] != 0 {
        s.halt_next[0] = 1;
        return;
    }
    s.counters[0].done += 1;
    let (mut place, mut residue) = (take(&mut s.place_next), take(&mut s.residue_next));
    let (mut motion, mut spin) = (take(&mut s.motion_next), take(&mut s.spin_next));
    let (mut travel, mut neighbour, mut spring) = (take(&mut s.travel), take(&mut s.neighbour), take(&mut s.spring));
    let (bad, spent) = by_body(&mut place, s)
        .zip(by_body(&mut residue, s))
        .zip(by_body(&mut motion, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut travel, s))
        .zip(by_slot(&mut neighbour, s))
        .zip(by_slot(&mut spring, s))
        .map(|((((((place, residue), motion), spin), travel), neighbour), spring)| Block {
            place,
            residue,
            motion,
            spin,
            travel,
            neighbour,
            spring,
        })
        .enumerate()
        .map(|(k, mut block)| advance_block(s, k * super::BLOCK, &mut block))
        .reduce(|| (0, false), |a, b| (a.0.max(b.0), a.1 | b.1));
    (s.place_next, s.residue_next, s.motion_next, s.spin_next) = (place, residue, motion, spin);
    (s.travel, s.neighbour, s.spring) = (travel, neighbour, spring);
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    s.halt_next[0] = s.halt_next[0].max(u32::from(spent));
}

/// A run of grains, the first of which is `first`: the mark of the first bad one, and whether the lists are spent.
fn advance_block(s: &State, first: usize, block: &mut Block) -> (u32, bool) {
    let (mut bad, mut spent) = (0, false);
    let first_slot = s.slot_start[first] as usize;
    for k in 0..block.place.len() {
        let i = first + k;
        let here = body(s, i);
        let row = s.slot_start[i] as usize - first_slot..s.slot_start[i + 1] as usize - first_slot;
        let springs = block.spring.get_mut(row.clone()).unwrap_or_default();
        let (sum, crossed) = pushed(s, i, &here, &mut block.neighbour[row], springs);
        let v = advanced(s, &here.motion, sum.force);
        let point = wrapped(s, moved(s, here.place.x, here.residue.x, s.params.dt * v));
        block.place[k] = Place { x: point.x, radius: here.place.radius };
        if let Some(residue) = block.residue.get_mut(k) {
            residue.x = point.residue;
            residue.radius = here.residue.radius;
        }
        block.motion[k] = Motion { v, inverse_mass: here.motion.inverse_mass };
        if let Some(spin) = block.spin.get_mut(k) {
            spin.0 = advanced_spin(s, &here, sum.torque);
        }
        let stride = s.params.dt * v.length();
        block.travel[k] += stride;
        let lost = crossed || outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        if lost {
            bad = bad.max(s.params.bodies - s.number[i]);
        }
        spent |= lost || !(block.travel[k] <= s.params.drift_limit);
    }
    (bad, spent)
}

/// All contacts of grain i, whose springs are stretched by this, and whether its centre is beyond a wall.
fn pushed(s: &State, i: usize, here: &Body, entries: &mut [u32], springs: &mut [Packed]) -> (Gathered, bool) {
    let (mut sum, mut crossed) = (Gathered::default(), false);
    for (k, entry) in entries.iter_mut().enumerate() {
        if *entry == NONE {
            break;
        }
        let j = (*entry & INDEX) as usize;
        if !near(s, &here.place, j) {
            forget_spring(entry);
            continue;
        }
        let contact = contact_of(s, i, here, j, spring_of(*entry, springs.get(k)));
        if contact.gap < 0.0 {
            keep_spring(entry, springs.get_mut(k), contact.spring);
            sum.add(&contact);
            crossed |= j >= s.sizes.bodies && contact.gap < -here.place.radius;
        } else {
            forget_spring(entry);
        }
    }
    (sum, crossed)
}
