//! A step of the CPU engine. `advance` and `member_forces` walk the lists of the state, where each of two grains in
//! contact computes it for itself; here a contact is computed once. Grains are worked on in blocks, in the order in which
//! they are sorted. A block copies its grains and those of other blocks that may touch them into one place, and goes
//! through the pairs of these, many at a time. A pair of two blocks is computed by both.
//!
//! Pairs are in the order of the numbers of their grains, first those of the grain with the smallest number. So what acts
//! on a grain is added up in the order of its list, and the bits are those of the twins, whatever the blocks are.
//!
//! What contacts remember is here while steps are done, and put back into the state before anybody else looks.

use super::{
    ADVANCE, ADVANCE_LARGE, INTEGRATE_CLUMPS, MEMBER_FORCES, PLACE_MEMBERS,
    advance::{Next, begin_step, end_step, is_beyond},
    member_forces::Loads,
};
use crate::{
    body::{
        Body, ForceTorque,
        blocks::BLOCK,
        bodies::{Limits, body},
    },
    contact::{
        batch::{Batch, Grain, LANES, Pairs, Rows, ZERO, at, set},
        history::{History, Lists, history_of, with_lists},
        law::wall_contact,
        rolling::RollingHistory,
        tangential::TangentialHistory,
    },
    model::{Precision, Rolling, Tangential},
    neighbours::{ORDER_LONG_LISTS, ORDER_NEIGHBOURS},
    plan::Op,
    space::MOVE_WALLS,
    state::{ACTIVE, Array, HALTED, INDEX, Length, NONE, State, array},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// The blocks of a state.
#[derive(Default)]
pub struct Blocks {
    blocks: Vec<Block>,
    /// Whether they are those of the present lists.
    current: bool,
    /// Whether contacts here remember more than those of the state.
    ahead: bool,
}

impl Blocks {
    /// Do an operation, if there is something better to do than what its twin does: whether there was.
    pub fn run(&mut self, op: &Op, s: &mut State) -> bool {
        match op {
            _ if s.model.precision == Precision::Single => return false,
            Op::Run(stage) if **stage == ADVANCE => self.advance(s),
            Op::Run(stage) if **stage == MEMBER_FORCES => self.member_forces(s),
            Op::Run(stage) if **stage == ADVANCE_LARGE => {} // done by `advance`
            Op::Run(stage) if [&INTEGRATE_CLUMPS, &PLACE_MEMBERS, &MOVE_WALLS].contains(stage) => return false,
            Op::Swap(..) => return false,
            Op::Clear(array) => {
                self.forget(array);
                return false;
            }
            Op::Run(stage) => {
                self.put_back(s);
                self.current &= ![&ORDER_NEIGHBOURS, &ORDER_LONG_LISTS].contains(stage);
                return false;
            }
        }
        true
    }

    /// An array of the state gets another content.
    pub fn forget(&mut self, array: &Array) {
        self.current &= *array != array::LIST_START && array.length != Length::Entries;
    }

    /// What contacts remember, into the lists of the state.
    pub fn put_back(&mut self, s: &mut State) {
        if std::mem::take(&mut self.ahead) && self.current {
            let blocks = self.blocks.par_iter();
            with_lists(s, blocks, |_, _, block, mut lists| block.put_back(&mut lists), |(), ()| (), || ());
        }
    }

    /// Blocks of the present lists, before a step.
    fn update(&mut self, s: &State) {
        if !self.current {
            let bodies = s.sizes.bodies;
            let blocks = (0..bodies.div_ceil(BLOCK)).into_par_iter();
            self.blocks = blocks.map(|k| Block::new(s, k * BLOCK..((k + 1) * BLOCK).min(bodies))).collect();
        }
        (self.current, self.ahead) = (true, true);
    }

    fn advance(&mut self, s: &mut State) {
        if !begin_step(s) {
            s.halt_next[0] = HALTED;
            return;
        }
        self.update(s);
        let mut next = Next::take(s);
        let steps = next.blocks(s).zip(&mut self.blocks);
        let limits = steps
            .map_init(Workspace::default, |workspace, (mut next, block)| {
                let run = block.grains.clone();
                let mut limits = Limits::default();
                let each = |i: usize, here: &Body, sum: ForceTorque, crossed: bool| {
                    limits = limits.and(next.advance(s, (i, i - run.start), here, &sum, crossed));
                };
                Arch::new().dispatch(Work { s, block, workspace, each });
                limits
            })
            .reduce(Limits::default, Limits::and);
        next.put(s);
        end_step(s, limits);
    }

    fn member_forces(&mut self, s: &mut State) {
        if !begin_step(s) {
            return;
        }
        self.update(s);
        let mut loads = Loads::take(s);
        let steps = loads.blocks(s).zip(&mut self.blocks);
        let limits = steps
            .map_init(Workspace::default, |workspace, (mut loads, block)| {
                let run = block.grains.clone();
                let mut limits = Limits::default();
                let each = |i: usize, _: &Body, sum: ForceTorque, crossed: bool| {
                    limits = limits.and(loads.store(s, (i, i - run.start), &sum, crossed));
                };
                Arch::new().dispatch(Work { s, block, workspace, each });
                limits
            })
            .reduce(Limits::default, Limits::and);
        loads.put(s);
        end_step(s, limits);
    }
}

/// What a task computes in.
#[derive(Default)]
struct Workspace {
    grains: Vec<Grain>,
    sums: Vec<ForceTorque>,
}

/// A run of grains, and their contacts.
struct Block {
    grains: Range<usize>,
    /// The others that they may touch, in ascending order.
    halo: Vec<u32>,
    /// Pairs of grains, counted from the first of the run and on through the halo. Of each the first has the smaller
    /// number; the last lanes may be of no pair.
    pairs: Vec<Pairs>,
    /// Their entries in the lists of the block; none of grains of other blocks.
    entries: Vec<[u32; 2]>,
    is_active: Vec<[bool; LANES]>,
    /// Empty what the model does not have.
    force: Vec<Rows>,
    torque: Vec<Rows>,
    /// In the order of the grains.
    walls: Vec<WallPair>,
}

/// A grain and a wall.
struct WallPair {
    grain: u32,
    wall: u32,
    entry: u32,
    is_active: bool,
    history: History,
}

/// A pair in the making: the numbers of the first and the second grain, where these are, and their entries.
type Found = (u64, [u32; 2], [u32; 2]);

impl Block {
    fn new(s: &State, grains: Range<usize>) -> Block {
        let first_entry = s.list_start[grains.start];
        let in_block = |entry: usize| entry as u32 - first_entry;
        let row = |i: usize| s.row(i).take_while(|&entry| s.neighbour[entry] != NONE);
        let other = |entry: usize| (s.neighbour[entry] & INDEX) as usize;
        let is_grain = |&entry: &usize| other(entry) < s.sizes.bodies;

        let others = |i: usize| row(i).filter(is_grain).map(other).filter(|j| !grains.contains(j));
        let mut halo: Vec<u32> = grains.clone().flat_map(others).map(|j| j as u32).collect();
        halo.sort_unstable();
        halo.dedup();

        let mut found: Vec<Found> = Vec::with_capacity(s.row(grains.end - 1).end - first_entry as usize);
        let mut walls = Vec::new();
        for i in grains.clone() {
            let (mine, at) = (s.id[i], (i - grains.start) as u32);
            for entry in row(i) {
                let j = other(entry);
                if j >= s.sizes.bodies {
                    let wall = (j - s.sizes.bodies) as u32;
                    let is_active = s.neighbour[entry] & ACTIVE != 0;
                    let history = history_of(s, entry);
                    walls.push(WallPair { grain: at, wall, entry: in_block(entry), is_active, history });
                    continue;
                }
                let theirs = s.id[j];
                let key = (u64::from(mine.min(theirs)) << 32) | u64::from(mine.max(theirs));
                if !grains.contains(&j) {
                    let there = (grains.len() + halo.partition_point(|&k| (k as usize) < j)) as u32;
                    if mine < theirs {
                        found.push((key, [at, there], [in_block(entry), NONE]));
                    } else {
                        found.push((key, [there, at], [NONE, in_block(entry)]));
                    }
                } else if mine < theirs {
                    let back = row(j).find(|&entry| other(entry) == i).expect("lists are symmetric");
                    found.push((key, [at, (j - grains.start) as u32], [in_block(entry), in_block(back)]));
                }
            }
        }
        found.sort_unstable_by_key(|(key, ..)| *key);

        let groups = found.len().div_ceil(LANES);
        let kept = |present: bool| vec![ZERO; if present { groups } else { 0 }];
        let mut block = Block {
            grains,
            halo,
            pairs: vec![[[0; LANES]; 2]; groups],
            entries: found.iter().map(|(_, _, entries)| *entries).collect(),
            is_active: vec![[false; LANES]; groups],
            force: kept(s.model.tangential != Tangential::None),
            torque: kept(s.model.rolling != Rolling::None),
            walls,
        };
        for (k, (_, [a, b], [entry, back])) in found.into_iter().enumerate() {
            let (group, lane) = (k / LANES, k % LANES);
            (block.pairs[group][0][lane], block.pairs[group][1][lane]) = (a, b);
            let (entry, sign) = if entry == NONE { (back, -1.0) } else { (entry, 1.0) };
            let entry = (first_entry + entry) as usize;
            if s.neighbour[entry] & ACTIVE != 0 {
                block.is_active[group][lane] = true;
                let history = history_of(s, entry);
                if let Some(force) = block.force.get_mut(group) {
                    set(force, lane, sign * history.tangential.force);
                }
                if let Some(torque) = block.torque.get_mut(group) {
                    set(torque, lane, sign * history.rolling.torque);
                }
            }
        }
        block
    }

    fn put_back(&self, lists: &mut Lists) {
        for (k, entries) in self.entries.iter().enumerate() {
            let (group, lane) = (k / LANES, k % LANES);
            for (entry, sign) in entries.iter().zip([1.0, -1.0]).filter(|(entry, _)| **entry != NONE) {
                let of = |rows: &[Rows]| sign * rows.get(group).map_or(DVec3::ZERO, |rows| at(rows, lane));
                let tangential = TangentialHistory { force: of(&self.force) };
                let rolling = RollingHistory { torque: of(&self.torque) };
                lists.remember(*entry as usize, self.is_active[group][lane], &History { tangential, rolling });
            }
        }
        for wall in &self.walls {
            lists.remember(wall.entry as usize, wall.is_active, &wall.history);
        }
    }

    /// What other grains do to those of the block.
    #[inline(always)]
    fn forces_of_grains(&mut self, s: &State, Workspace { grains, sums }: &mut Workspace) {
        grains.clear();
        grains.extend(self.grains.clone().map(|i| Grain::of(s, i)));
        grains.extend(self.halo.iter().map(|&j| Grain::of(s, j as usize)));
        sums.clear();
        sums.resize(grains.len(), ForceTorque::default());
        let (mut batch, count) = (Batch::new(s), self.entries.len());
        for (group, pairs) in self.pairs.iter().enumerate() {
            batch.springs.is_active = self.is_active[group];
            if let Some(force) = self.force.get(group) {
                batch.springs.force = *force;
            }
            if let Some(torque) = self.torque.get(group) {
                batch.springs.torque = *torque;
            }
            batch.compute(s, grains, pairs);
            self.is_active[group] = batch.springs.is_active;
            if let Some(force) = self.force.get_mut(group) {
                *force = batch.springs.force;
            }
            if let Some(torque) = self.torque.get_mut(group) {
                *torque = batch.springs.torque;
            }
            batch.add(pairs, (count - group * LANES).min(LANES), sums);
        }
    }
}

/// A task: contact forces of a block, then something for each of its grains. It is compiled for the vectors that
/// machines have, with all that is inlined into it.
struct Work<'a, F> {
    s: &'a State,
    block: &'a mut Block,
    workspace: &'a mut Workspace,
    /// Of grain i, with what acts on it, and whether its centre is beyond a wall.
    each: F,
}

impl<F: FnMut(usize, &Body, ForceTorque, bool)> WithSimd for Work<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        let (s, block) = (self.s, self.block);
        block.forces_of_grains(s, self.workspace);
        let mut walls = block.walls.iter_mut().peekable();
        for (i, sum) in block.grains.clone().zip(&mut self.workspace.sums) {
            let (here, k, mut crossed) = (body(s, i), (i - block.grains.start) as u32, false);
            while let Some(pair) = walls.next_if(|pair| pair.grain == k) {
                let contact = wall_contact(s, i, &here, pair.wall as usize, pair.is_active, pair.history);
                (pair.is_active, pair.history) = (contact.is_active, contact.history);
                if contact.is_active {
                    sum.add(&contact);
                    crossed |= is_beyond(s, &contact, &here);
                }
            }
            (self.each)(i, &here, *sum, crossed);
        }
    }
}
