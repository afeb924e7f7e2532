//! Twin of `shaders/dem/advance.wgsl`: contact forces at step n, then leapfrog: n - 1/2 to n + 1/2 (2.19), n to n + 1
//! (2.20). Large grains have a stage of their own.

use crate::body::blocks::{BLOCK, by_body, first_entry};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::{Limits, NextPositions, NextVelocities, body, changed_velocities},
        rotation::{sphere_spin_change, spin_change},
    },
    contact::{
        batch::{Batch, LANES, ListEntry, Outcome},
        geometry::closer_than,
        history::{Lists, with_lists},
        law::wall_contact,
    },
    dem::leapfrog::velocity_change,
    space::{boundary::wrap, precision::displaced, walls::is_crossed},
    state::{HALTED, INDEX, NONE, State},
};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::{mem::take, ops::Range};

/// What a task writes: a run of grains, and their lists.
struct Block<'a> {
    next: NextPositions<'a>,
    velocities: NextVelocities<'a>,
    lists: Lists<'a>,
}

pub fn advance(s: &mut State) {
    if s.halt[0] >= HALTED {
        s.halt_next[0] = HALTED;
        return;
    }
    s.counters[0].steps_done += 1;
    s.halt_next[0] = s.halt[0] + 1;
    advance_bodies(s, 0..s.sizes.bodies - s.sizes.large);
}

/// Advance these grains.
pub fn advance_bodies(s: &mut State, bodies: Range<usize>) {
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let (mut velocity, mut spin) = (take(&mut s.velocity_next), take(&mut s.spin_next));
    let mut velocity_low = take(&mut s.velocity_low_next);
    let mut displacement = take(&mut s.displacement);
    let blocks = by_body(&mut position, s)
        .zip(by_body(&mut low, s))
        .zip(by_body(&mut velocity, s))
        .zip(by_body(&mut spin, s))
        .zip(by_body(&mut velocity_low, s))
        .zip(by_body(&mut displacement, s));
    let work =
        |s: &State, k: usize, (((((position, low), velocity), spin), velocity_low), displacement), lists: Lists| {
            let velocities = NextVelocities { velocity, spin, low: velocity_low };
            let block = Block { next: NextPositions { position, low, displacement }, velocities, lists };
            let first = k * BLOCK;
            let run = bodies.start.max(first)..bodies.end.min(first + block.velocities.velocity.len());
            if run.is_empty() { Limits::default() } else { Arch::new().dispatch(Work { s, first, run, block }) }
        };
    let limits = with_lists(s, blocks, work, Limits::and, Limits::default);
    (s.position_next, s.position_low_next, s.velocity_next, s.spin_next) = (position, low, velocity, spin);
    (s.velocity_low_next, s.displacement) = (velocity_low, displacement);
    s.counters[0].lost_body = s.counters[0].lost_body.max(limits.lost_body);
    if limits.halt {
        s.halt_next[0] = HALTED;
    }
}

/// A task. It is compiled for the vectors that machines have, with all that is inlined into it.
struct Work<'a> {
    s: &'a State,
    first: usize,
    run: Range<usize>,
    block: Block<'a>,
}

impl WithSimd for Work<'_> {
    type Output = Limits;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Limits {
        advance_block(self.s, self.first, self.run, &mut self.block)
    }
}

/// A run of grains of a block, the first of which is `first`.
#[inline(always)]
fn advance_block(s: &State, first: usize, run: Range<usize>, block: &mut Block) -> Limits {
    let mut limits = Limits::default();
    let Sums { of_grains, first_wall } = forces_of_grains(s, first, run.clone(), &mut block.lists);
    let begin = first_entry(s, first);
    for i in run {
        let k = i - first;
        let mut sum = of_grains[k];
        let here = body(s, i);
        let walls = s.row(i).from(begin).skip(first_wall[k]);
        let crossed = forces_of_walls(s, i, &here, walls, &mut block.lists, &mut sum);
        let change = velocity_change(s, &here.velocity, sum.force);
        let changed = changed_velocities(s, i, &here, change, sphere_spin_change(s, &here, sum.torque, spin_change));
        let v = changed.velocity.v;
        block.velocities.store(k, changed);
        let point = wrap(s, displaced(s, here.position.x, here.low.x, s.params.dt * v));
        limits = limits.and(block.next.commit_position(s, (i, k), point, s.params.dt * v.length(), crossed));
    }
    limits
}

/// What grains do to the grains of a block, and how many entries come before their walls.
pub struct Sums {
    pub of_grains: [ForceTorque; BLOCK],
    pub first_wall: [usize; BLOCK],
}

impl Sums {
    /// What came of the contact at an entry of a block whose first grain is `first`.
    #[inline(always)]
    fn add(&mut self, first: usize, entry: &ListEntry, contact: Outcome, lists: &mut Lists) {
        let (k, at) = (entry.i as usize - first, entry.index as usize);
        if contact.is_active {
            lists.set_history(at, &contact.history);
            self.of_grains[k].force += contact.sum.force;
            self.of_grains[k].torque += contact.sum.torque;
        }
        lists.set_active(at, contact.is_active);
    }
}

/// The contacts of a run of grains with grains, and what they remember; its block begins with the grain `first`. Many
/// are computed at a time, and added in the order of the lists.
#[inline(always)]
pub fn forces_of_grains(s: &State, first: usize, run: Range<usize>, lists: &mut Lists) -> Sums {
    let mut sums = Sums { of_grains: [ForceTorque::default(); BLOCK], first_wall: [0; BLOCK] };
    let entries = near_entries(s, first, run, lists, &mut sums.first_wall);
    if !Batch::serves(s) {
        entries.iter().for_each(|entry| sums.add(first, entry, Outcome::of(s, entry, lists), lists));
        return sums;
    }
    let mut batch = Batch::new(s);
    for entries in entries.chunks(LANES) {
        batch.compute(s, entries, lists);
        for (lane, entry) in entries.iter().enumerate() {
            sums.add(first, entry, batch.outcome(lane), lists);
        }
    }
    sums
}

/// The entries of grains that may act on each other.
#[inline(always)]
fn near_entries(
    s: &State,
    first: usize,
    run: Range<usize>,
    lists: &mut Lists,
    first_wall: &mut [usize],
) -> Vec<ListEntry> {
    let mut entries = vec![ListEntry::default(); lists.neighbour.len()];
    let (mut found, begin) = (0, first_entry(s, first));
    for (i, first_wall) in run.clone().zip(&mut first_wall[run.start - first..]) {
        let (here, row) = (&s.position[i], s.row(i).from(begin));
        *first_wall = row.len();
        for (k, entry) in row.enumerate() {
            let tagged = &mut lists.neighbour[entry];
            let j = *tagged & INDEX;
            let Some(there) = s.position.get(j as usize) else {
                *first_wall = k;
                break;
            };
            let near = closer_than(s, here, there, s.params.reach);
            // Whether grains are near is hard to guess, and a wrong guess costs more than a store.
            *tagged = if near { *tagged } else { j };
            entries[found] = ListEntry { i: i as u32, j, index: entry as u32 };
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
    entries: impl Iterator<Item = usize>,
    lists: &mut Lists,
    sum: &mut ForceTorque,
) -> bool {
    let mut crossed = false;
    for entry in entries {
        let tagged = lists.neighbour[entry];
        if tagged == NONE {
            break;
        }
        let w = (tagged & INDEX) as usize - s.sizes.bodies;
        let contact = wall_contact(s, i, here, w, lists.is_active(entry), lists.history(entry));
        if contact.is_active {
            lists.set_history(entry, &contact.history);
            sum.add(&contact);
            crossed |= is_crossed(s, contact.gap, here.position.radius);
        }
        lists.set_active(entry, contact.is_active);
    }
    crossed
}
