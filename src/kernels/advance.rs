//! Twin of `shaders/advance.wgsl`: contact forces at step n, then leapfrog: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).

use super::{BLOCK, by_body, by_slot};
use crate::{
    laws::{
        batch::{Batch, LANES, Side},
        boundary::wrapped,
        contact::{Body, Gathered, body, wall_contact},
        dimension::outside,
        friction::{flag, keep_spring, spring_of},
        leapfrog::advanced,
        precision::moved,
        rotation::advanced_spin,
        touch::within,
    },
    state::{INDEX, Motion, NONE, Packed, Place, Residue, Spin, State},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::{mem::take, ops::Range};

/// What a task writes: a run of grains, and their slots.
struct Block<'a> {
    place: &'a mut [Place],
    residue: &'a mut [Residue],
    motion: &'a mut [Motion],
    spin: &'a mut [Spin],
    travel: &'a mut [f64],
    lists: Lists<'a>,
}

/// The slots of a run of grains.
pub struct Lists<'a> {
    pub neighbour: &'a mut [u32],
    pub spring: &'a mut [Packed],
}

impl Lists<'_> {
    /// What smooth grains do not have is not kept.
    #[inline(always)]
    fn keep_spring(&mut self, slot: usize, f: DVec3) {
        if let Some(spring) = self.spring.get_mut(slot) {
            keep_spring(spring, f);
        }
    }

    #[inline(always)]
    fn flag(&mut self, slot: usize, closed: bool) {
        flag(&mut self.neighbour[slot], closed && !self.spring.is_empty());
    }
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
            lists: Lists { neighbour, spring },
        })
        .enumerate()
        .with_min_len(2)
        .map(|(k, block)| Arch::new().dispatch(Work { s, first: k * BLOCK, block }))
        .reduce(|| (0, false), |a, b| (a.0.max(b.0), a.1 | b.1));
    (s.place_next, s.residue_next, s.motion_next, s.spin_next) = (place, residue, motion, spin);
    (s.travel, s.neighbour, s.spring) = (travel, neighbour, spring);
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    s.halt_next[0] = s.halt_next[0].max(u32::from(spent));
}

/// A task. It is compiled for the vectors that machines have, with all that is inlined into it.
struct Work<'a> {
    s: &'a State,
    first: usize,
    block: Block<'a>,
}

impl WithSimd for Work<'_> {
    type Output = (u32, bool);

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> (u32, bool) {
        advance_block(self.s, self.first, &mut self.block)
    }
}

/// A run of grains, the first of which is `first`: the mark of the first bad one, and whether the lists are spent.
#[inline(always)]
fn advance_block(s: &State, first: usize, block: &mut Block) -> (u32, bool) {
    let (mut bad, mut spent) = (0, false);
    let Sums { of_grains, first_wall } = pushed_by_grains(s, first, block.place.len(), &mut block.lists);
    for k in 0..block.place.len() {
        let (i, mut sum) = (first + k, of_grains[k]);
        let here = body(s, i);
        let walls = first_wall[k]..row_in_block(s, first, i).end;
        let crossed = pushed_by_walls(s, i, &here, walls, &mut block.lists, &mut sum);
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

/// What grains do to the grains of a block, and the slots where their walls begin.
pub struct Sums {
    pub of_grains: [Gathered; BLOCK],
    pub first_wall: [usize; BLOCK],
}

/// The contacts of a run of `count` grains with grains, with their springs. Many are computed at a time, and added in the order of
/// the lists.
#[inline(always)]
pub fn pushed_by_grains(s: &State, first: usize, count: usize, lists: &mut Lists) -> Sums {
    let mut sums = Sums { of_grains: [Gathered::default(); BLOCK], first_wall: [0; BLOCK] };
    let mut batch = Batch::new(s);
    for sides in near_sides(s, first, lists, &mut sums.first_wall[..count]).chunks(LANES) {
        batch.compute(s, sides, |side| {
            let slot = side.slot as usize;
            spring_of(lists.neighbour[slot], lists.spring.get(slot))
        });
        for (lane, side) in sides.iter().enumerate() {
            let (k, slot) = (side.i as usize - first, side.slot as usize);
            let contact = batch.outcome(lane);
            let closed = contact.gap < 0.0;
            if closed {
                lists.keep_spring(slot, contact.spring);
                sums.of_grains[k].force += contact.sum.force;
                sums.of_grains[k].torque += contact.sum.torque;
            }
            lists.flag(slot, closed);
        }
    }
    sums
}

/// The slots of grain i, counted from the first of its block.
#[inline(always)]
pub fn row_in_block(s: &State, first: usize, i: usize) -> Range<usize> {
    let begin = s.slot_start[first];
    (s.slot_start[i] - begin) as usize..(s.slot_start[i + 1] - begin) as usize
}

/// The slots with grains that may touch.
#[inline(always)]
fn near_sides(s: &State, first: usize, lists: &mut Lists, first_wall: &mut [usize]) -> Vec<Side> {
    let mut sides = vec![Side::default(); lists.neighbour.len()];
    let mut found = 0;
    for (k, first_wall) in first_wall.iter_mut().enumerate() {
        let i = first + k;
        let (here, row) = (&s.place[i], row_in_block(s, first, i));
        *first_wall = row.end;
        for slot in row {
            let entry = &mut lists.neighbour[slot];
            let j = *entry & INDEX;
            let Some(there) = s.place.get(j as usize) else {
                *first_wall = slot;
                break;
            };
            let near = within(s, here, there, 0.0);
            // Whether grains are near is hard to guess, and a wrong guess costs more than a store.
            *entry = if near { *entry } else { j };
            sides[found] = Side { i: i as u32, j, slot: slot as u32 };
            found += usize::from(near);
        }
    }
    sides.truncate(found);
    sides
}

/// What walls add to the sum of grain i, and whether its centre is beyond one. They are the last in its list.
#[inline(always)]
pub fn pushed_by_walls(
    s: &State,
    i: usize,
    here: &Body,
    slots: Range<usize>,
    lists: &mut Lists,
    sum: &mut Gathered,
) -> bool {
    let mut crossed = false;
    for slot in slots {
        let entry = lists.neighbour[slot];
        if entry == NONE {
            break;
        }
        let w = (entry & INDEX) as usize - s.sizes.bodies;
        let contact = wall_contact(s, i, here, w, spring_of(entry, lists.spring.get(slot)));
        let closed = contact.closed;
        if closed {
            lists.keep_spring(slot, contact.spring);
            sum.add(&contact);
            crossed |= contact.gap < -here.place.radius;
        }
        lists.flag(slot, closed);
    }
    crossed
}
