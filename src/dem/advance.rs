//! Twin of `shaders/dem/advance.wgsl`: contact forces at step n, then leapfrog: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).

use crate::body::blocks::{BLOCK, by_body, by_entry};
use crate::{
    body::{Body, ForceTorque, bodies::body, rotation::integrate_sphere_spin},
    contact::{
        batch::{Batch, LANES, ListEntry},
        geometry::closer_than,
        history::{keep_spring, set_active, spring_of},
        law::wall_contact,
    },
    dem::leapfrog::integrate_velocity,
    space::{boundary::wrap, dimension::outside, precision::displaced},
    state::{INDEX, NONE, Packed, Position, PositionLow, Spin, State, Velocity},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::{mem::take, ops::Range};

/// What a task writes: a run of grains, and their slots.
struct Block<'a> {
    position: &'a mut [Position],
    low: &'a mut [PositionLow],
    velocity: &'a mut [Velocity],
    spin: &'a mut [Spin],
    displacement: &'a mut [f64],
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
    fn set_active(&mut self, slot: usize, closed: bool) {
        set_active(&mut self.neighbour[slot], closed && !self.spring.is_empty());
    }
}

pub fn advance(s: &mut State) {
    if s.halt[0] != 0 {
        s.halt_next[0] = 1;
        return;
    }
    s.counters[0].steps_done += 1;
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let (mut velocity, mut spin) = (take(&mut s.velocity_next), take(&mut s.spin_next));
    let (mut displacement, mut neighbour, mut spring) =
        (take(&mut s.displacement), take(&mut s.neighbour), take(&mut s.spring));
    let (bad, spent) = by_body(&mut position, s)
        .zip(by_body(&mut low, s))
        .zip(by_body(&mut velocity, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut displacement, s))
        .zip(by_entry(&mut neighbour, s))
        .zip(by_entry(&mut spring, s))
        .map(|((((((position, low), velocity), spin), displacement), neighbour), spring)| Block {
            position,
            low,
            velocity,
            spin,
            displacement,
            lists: Lists { neighbour, spring },
        })
        .enumerate()
        .with_min_len(2)
        .map(|(k, block)| Arch::new().dispatch(Work { s, first: k * BLOCK, block }))
        .reduce(|| (0, false), |a, b| (a.0.max(b.0), a.1 | b.1));
    (s.position_next, s.position_low_next, s.velocity_next, s.spin_next) = (position, low, velocity, spin);
    (s.displacement, s.neighbour, s.spring) = (displacement, neighbour, spring);
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
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
    let Sums { of_grains, first_wall } = forces_of_grains(s, first, block.position.len(), &mut block.lists);
    for k in 0..block.position.len() {
        let (i, mut sum) = (first + k, of_grains[k]);
        let here = body(s, i);
        let walls = first_wall[k]..row_in_block(s, first, i).end;
        let crossed = forces_of_walls(s, i, &here, walls, &mut block.lists, &mut sum);
        let v = integrate_velocity(s, &here.velocity, sum.force);
        let point = wrap(s, displaced(s, here.position.x, here.low.x, s.params.dt * v));
        block.position[k] = Position { x: point.x, radius: here.position.radius };
        if let Some(low) = block.low.get_mut(k) {
            low.x = point.low;
            low.radius = here.low.radius;
        }
        block.velocity[k] = Velocity { v, inverse_mass: here.velocity.inverse_mass };
        if let Some(spin) = block.spin.get_mut(k) {
            spin.0 = integrate_sphere_spin(s, &here, sum.torque);
        }
        let stride = s.params.dt * v.length();
        block.displacement[k] += stride;
        let lost = crossed || outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        if lost {
            bad = bad.max(s.params.bodies - s.id[i]);
        }
        spent |= lost || !(block.displacement[k] <= s.params.displacement_limit);
    }
    (bad, spent)
}

/// What grains do to the grains of a block, and the slots where their walls begin.
pub struct Sums {
    pub of_grains: [ForceTorque; BLOCK],
    pub first_wall: [usize; BLOCK],
}

/// The contacts of a run of `count_neighbours` grains with grains, with their springs. Many are computed at a time, and added in the order of
/// the lists.
#[inline(always)]
pub fn forces_of_grains(s: &State, first: usize, count: usize, lists: &mut Lists) -> Sums {
    let mut sums = Sums { of_grains: [ForceTorque::default(); BLOCK], first_wall: [0; BLOCK] };
    let mut batch = Batch::new(s);
    for entries in near_entries(s, first, lists, &mut sums.first_wall[..count]).chunks(LANES) {
        batch.compute(s, entries, |entry| {
            let slot = entry.index as usize;
            spring_of(lists.neighbour[slot], lists.spring.get(slot))
        });
        for (lane, entry) in entries.iter().enumerate() {
            let (k, slot) = (entry.i as usize - first, entry.index as usize);
            let contact = batch.outcome(lane);
            let closed = contact.gap < 0.0;
            if closed {
                lists.keep_spring(slot, contact.spring);
                sums.of_grains[k].force += contact.sum.force;
                sums.of_grains[k].torque += contact.sum.torque;
            }
            lists.set_active(slot, closed);
        }
    }
    sums
}

/// The slots of grain i, counted from the first of its block.
#[inline(always)]
pub fn row_in_block(s: &State, first: usize, i: usize) -> Range<usize> {
    let begin = s.list_start[first];
    (s.list_start[i] - begin) as usize..(s.list_start[i + 1] - begin) as usize
}

/// The slots with grains that may touch.
#[inline(always)]
fn near_entries(s: &State, first: usize, lists: &mut Lists, first_wall: &mut [usize]) -> Vec<ListEntry> {
    let mut entries = vec![ListEntry::default(); lists.neighbour.len()];
    let mut found = 0;
    for (k, first_wall) in first_wall.iter_mut().enumerate() {
        let i = first + k;
        let (here, row) = (&s.position[i], row_in_block(s, first, i));
        *first_wall = row.end;
        for slot in row {
            let entry = &mut lists.neighbour[slot];
            let j = *entry & INDEX;
            let Some(there) = s.position.get(j as usize) else {
                *first_wall = slot;
                break;
            };
            let near = closer_than(s, here, there, 0.0);
            // Whether grains are near is hard to guess, and a wrong guess costs more than a store.
            *entry = if near { *entry } else { j };
            entries[found] = ListEntry { i: i as u32, j, index: slot as u32 };
            found += usize::from(near);
        }
    }
    entries.truncate(found);
    entries
}

/// What walls add to the sum of grain i, and whether its centre is beyond one. They are the last in its list.
#[inline(always)]
pub fn forces_of_walls(
    s: &State,
    i: usize,
    here: &Body,
    slots: Range<usize>,
    lists: &mut Lists,
    sum: &mut ForceTorque,
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
            crossed |= contact.gap < -here.position.radius;
        }
        lists.set_active(slot, closed);
    }
    crossed
}
