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
    advance::{Next, NextOfBlock, begin_step, contact_with, end_step, is_beyond},
    member_forces::{Loads, LoadsOfBlock},
};
use crate::{
    body::{
        Body, ForceTorque,
        blocks::BLOCK,
        bodies::{Limits, body},
    },
    contact::{
        batch::{Batch, Grain, LANES, MOST_GRAINS, OfGrains, Pairs, Rows, Springs, ZERO, at, set},
        history::{History, Lists, history_of, with_lists},
        materials::pair_index,
        rolling::RollingHistory,
        tangential::TangentialHistory,
    },
    model::{Materials, Precision, Rolling},
    neighbours::{ORDER_LONG_LISTS, ORDER_NEIGHBOURS},
    plan::Op,
    space::MOVE_WALLS,
    state::{ACTIVE, Array, HALTED, INDEX, Length, NONE, State, array},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::{cell::RefCell, ops::Range};

/// Bytes of blocks per entry of the lists, measured.
pub const BYTES_PER_ENTRY: u64 = 57;

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
            // Where lists lie side by side, the state is one of a device.
            _ if s.model.precision == Precision::Single || s.sizes.slice_shift != 0 => return false,
            Op::Run(stage) if **stage == ADVANCE => self.advance(s),
            Op::Run(stage) if **stage == MEMBER_FORCES => self.member_forces(s),
            Op::Run(stage) if **stage == ADVANCE_LARGE => {} // done by `advance`
            Op::Run(stage) if [&INTEGRATE_CLUMPS, &PLACE_MEMBERS, &MOVE_WALLS].contains(stage) => return false,
            Op::Swap(..) => return false,
            Op::Clear(array) => {
                self.put_back(s);
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
        let limits = self.step(s, next.blocks(s));
        next.put(s);
        end_step(s, limits);
    }

    fn member_forces(&mut self, s: &mut State) {
        if !begin_step(s) {
            return;
        }
        self.update(s);
        let mut loads = Loads::take(s);
        let limits = self.step(s, loads.blocks(s));
        loads.put(s);
        end_step(s, limits);
    }

    fn step<T: Pushed + Send>(&mut self, s: &State, grains: impl IndexedParallelIterator<Item = T>) -> Limits {
        grains
            .zip(&mut self.blocks)
            .map(|(grains, block)| {
                let work = |workspace: &mut Workspace| Arch::new().dispatch(Work { s, block, workspace, grains });
                WORKSPACE.with_borrow_mut(work)
            })
            .reduce(Limits::default, Limits::and)
    }
}

/// What a thread computes in.
struct Workspace {
    grains: Box<OfGrains<Grain>>,
    sums: Box<OfGrains<ForceTorque>>,
}

impl Workspace {
    fn new() -> Workspace {
        fn boxed<T: Copy + Default>() -> Box<OfGrains<T>> {
            vec![T::default(); MOST_GRAINS]
                .into_boxed_slice()
                .try_into()
                .unwrap_or_else(|_| unreachable!("it is as long"))
        }
        Workspace { grains: boxed(), sums: boxed() }
    }
}

thread_local!(static WORKSPACE: RefCell<Workspace> = RefCell::new(Workspace::new()));

/// A run of grains, and their contacts.
struct Block {
    grains: Range<usize>,
    /// Where their lists begin.
    first_entry: u32,
    /// The others that they may touch, in ascending order.
    halo: Vec<u32>,
    /// Pairs of grains, counted from the first of the run and on through the halo. Of each the first has the smaller
    /// number; the last lanes may be of no pair.
    pairs: Vec<Pairs>,
    /// Their entries in the lists of the block; none of grains of other blocks.
    entries: Vec<[u32; 2]>,
    /// Where their pairs of materials are in tables; empty if there is one material only.
    materials: Vec<[u32; LANES]>,
    is_active: Vec<[bool; LANES]>,
    force: Vec<Rows>,
    /// Empty if the model has no rolling resistance.
    torque: Vec<Rows>,
    /// Contacts that are computed one by one after these, in the order of the lists: those with walls, or all, if there
    /// are too many grains.
    single: Vec<Single>,
}

/// A contact of a grain with a neighbour, as in the lists.
struct Single {
    grain: u32,
    other: u32,
    entry: u32,
    is_active: bool,
    history: History,
}

impl Block {
    fn new(s: &State, grains: Range<usize>) -> Block {
        let row = |i: usize| s.row(i).take_while(|&entry| s.neighbour[entry] != NONE);
        let other = |entry: usize| (s.neighbour[entry] & INDEX) as usize;
        let is_grain = |&entry: &usize| other(entry) < s.sizes.bodies;
        let mut block = Block::empty(s, grains.clone());

        // Entries of grains of other blocks, by grain: in each run of a halo grain, the grains that may touch it.
        let own = grains.len();
        let mut across: Vec<(u32, u16)> = Vec::new();
        for (k, i) in grains.clone().enumerate() {
            let others = row(i).filter(is_grain).map(other).filter(|j| !grains.contains(j));
            across.extend(others.map(|j| (j as u32, k as u16)));
        }
        across.sort_unstable();
        let across: Vec<&[(u32, u16)]> = across.chunk_by(|a, b| a.0 == b.0).collect();
        if own + across.len() > MOST_GRAINS {
            grains.for_each(|i| row(i).for_each(|entry| block.push_single(s, i, entry)));
            return block;
        }
        block.halo = across.iter().map(|run| run[0].0).collect();

        // Grain by grain in the order of the numbers, each with those of larger numbers. So the next pair of a grain is
        // always that of its next entry.
        let mut order: Vec<(u32, u16)> = grains.clone().map(|i| s.id[i]).zip(0..).collect();
        order.extend(block.halo.iter().map(|&j| s.id[j as usize]).zip(own as u16..));
        order.sort_unstable();
        let mut next: Vec<usize> = grains.clone().map(|i| s.list_start[i] as usize).collect();
        for (id, first) in order {
            if let Some(run) = usize::from(first).checked_sub(own) {
                for &(_, second) in across[run].iter().filter(|(_, k)| s.id[grains.start + *k as usize] > id) {
                    let k = usize::from(second);
                    block.push(s, [first, second], [None, Some(next[k])]);
                    next[k] += 1;
                }
                continue;
            }
            let (k, i) = (usize::from(first), grains.start + usize::from(first));
            for entry in row(i).skip(next[k] - s.list_start[i] as usize) {
                let j = other(entry);
                if !is_grain(&entry) {
                    break;
                }
                if grains.contains(&j) {
                    let second = j - grains.start;
                    block.push(s, [first, second as u16], [Some(entry), Some(next[second])]);
                    next[second] += 1;
                } else {
                    let run = block.halo.partition_point(|&k| (k as usize) < j);
                    block.push(s, [first, (own + run) as u16], [Some(entry), None]);
                }
            }
        }
        for i in grains {
            row(i).filter(|entry| !is_grain(entry)).for_each(|entry| block.push_single(s, i, entry));
        }
        block
    }

    fn empty(s: &State, grains: Range<usize>) -> Block {
        let first_entry = s.list_start[grains.start];
        Block {
            grains,
            first_entry,
            halo: Vec::new(),
            pairs: Vec::new(),
            entries: Vec::new(),
            materials: Vec::new(),
            is_active: Vec::new(),
            force: Vec::new(),
            torque: Vec::new(),
            single: Vec::new(),
        }
    }

    /// A contact that is computed by itself.
    fn push_single(&mut self, s: &State, i: usize, entry: usize) {
        self.single.push(Single {
            grain: (i - self.grains.start) as u32,
            other: s.neighbour[entry] & INDEX,
            entry: entry as u32 - self.first_entry,
            is_active: s.neighbour[entry] & ACTIVE != 0,
            history: history_of(s, entry),
        });
    }

    /// A pair of grains, with their entries in the lists.
    fn push(&mut self, s: &State, [a, b]: [u16; 2], entries: [Option<usize>; 2]) {
        let (group, lane) = (self.entries.len() / LANES, self.entries.len() % LANES);
        if lane == 0 {
            self.pairs.push([[0; LANES]; 2]);
            self.is_active.push([false; LANES]);
            self.force.push(ZERO);
            self.torque.extend((s.model.rolling != Rolling::None).then_some(ZERO));
            self.materials.extend((s.model.materials == Materials::Many).then_some([0; LANES]));
        }
        self.entries.push(entries.map(|entry| entry.map_or(NONE, |entry| entry as u32 - self.first_entry)));
        (self.pairs[group][0][lane], self.pairs[group][1][lane]) = (a, b);
        let of_pair = pair_index(s, self.index(a), self.index(b)) as u32;
        if let Some(materials) = self.materials.get_mut(group) {
            materials[lane] = of_pair;
        }
        let (entry, sign) = match entries {
            [Some(entry), _] => (entry, 1.0),
            [None, entry] => (entry.expect("a pair has a grain of the block"), -1.0),
        };
        if s.neighbour[entry] & ACTIVE != 0 {
            self.is_active[group][lane] = true;
            let history = history_of(s, entry);
            set(&mut self.force[group], lane, sign * history.tangential.force);
            if let Some(torque) = self.torque.get_mut(group) {
                set(torque, lane, sign * history.rolling.torque);
            }
        }
    }

    /// Of a grain that pairs name.
    fn index(&self, grain: u16) -> usize {
        let k = grain as usize;
        k.checked_sub(self.grains.len()).map_or(self.grains.start + k, |k| self.halo[k] as usize)
    }

    fn put_back(&self, lists: &mut Lists) {
        for (k, entries) in self.entries.iter().enumerate() {
            let (group, lane) = (k / LANES, k % LANES);
            for (entry, sign) in entries.iter().zip([1.0, -1.0]).filter(|(entry, _)| **entry != NONE) {
                let tangential = TangentialHistory { force: sign * at(&self.force[group], lane) };
                let torque = self.torque.get(group).map_or(DVec3::ZERO, |torque| at(torque, lane));
                let rolling = RollingHistory { torque: sign * torque };
                lists.remember(*entry as usize, self.is_active[group][lane], &History { tangential, rolling });
            }
        }
        for single in &self.single {
            lists.remember(single.entry as usize, single.is_active, &single.history);
        }
    }

    /// What other grains do to those of the block.
    #[inline(always)]
    fn forces_of_grains(&mut self, s: &State, Workspace { grains, sums }: &mut Workspace) {
        let own = self.grains.len();
        for (grain, i) in grains.iter_mut().zip(self.grains.clone()) {
            grain.set(s, i);
        }
        for (grain, j) in grains[own..].iter_mut().zip(&self.halo) {
            grain.set(s, *j as usize);
        }
        sums[..own + self.halo.len()].fill(ForceTorque::default());
        let (mut batch, count) = (Batch::new(s), self.entries.len());
        for (group, pairs) in self.pairs.iter().enumerate() {
            let mut springs = Springs {
                is_active: &mut self.is_active[group],
                force: &mut self.force[group],
                torque: self.torque.get_mut(group),
            };
            batch.compute(s, grains, pairs, self.materials.get(group), &mut springs);
            batch.add(pairs, (count - group * LANES).min(LANES), sums);
        }
    }

    /// What contacts do to the grains of the block.
    #[inline(always)]
    fn step(&mut self, s: &State, workspace: &mut Workspace, mut grains: impl Pushed) -> Limits {
        self.forces_of_grains(s, workspace);
        let (mut single, mut limits) = (self.single.iter_mut().peekable(), Limits::default());
        for (k, sum) in workspace.sums[..self.grains.len()].iter_mut().enumerate() {
            let (i, mut crossed) = (self.grains.start + k, false);
            let here = body(s, i);
            while let Some(one) = single.next_if(|one| one.grain == k as u32) {
                let j = one.other as usize;
                let contact = contact_with(s, i, &here, j, one.is_active, one.history);
                (one.is_active, one.history) = (contact.is_active, History::default());
                if contact.is_active {
                    one.history = contact.history;
                    sum.add(&contact);
                    crossed |= j >= s.sizes.bodies && is_beyond(s, &contact, &here);
                }
            }
            limits = limits.and(grains.push(s, (i, k), &here, sum, crossed));
        }
        limits
    }
}

/// A run of grains that contact forces act on.
trait Pushed {
    /// Body i, the k-th of the run, gets the forces of its contacts, and is lost if its centre is beyond a wall.
    fn push(&mut self, s: &State, at: (usize, usize), here: &Body, sum: &ForceTorque, crossed: bool) -> Limits;
}

impl Pushed for NextOfBlock<'_> {
    #[inline(always)]
    fn push(&mut self, s: &State, at: (usize, usize), here: &Body, sum: &ForceTorque, crossed: bool) -> Limits {
        self.advance(s, at, here, sum, crossed)
    }
}

impl Pushed for LoadsOfBlock<'_> {
    #[inline(always)]
    fn push(&mut self, s: &State, at: (usize, usize), _: &Body, sum: &ForceTorque, crossed: bool) -> Limits {
        self.store(s, at, sum, crossed)
    }
}

/// A task: what contacts do to the grains of a block. It is compiled for the vectors that machines have, with all that is
/// inlined into it.
struct Work<'a, T> {
    s: &'a State,
    block: &'a mut Block,
    workspace: &'a mut Workspace,
    grains: T,
}

impl<T: Pushed> WithSimd for Work<'_, T> {
    type Output = Limits;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Limits {
        self.block.step(self.s, self.workspace, self.grains)
    }
}
