//! Contacts in blocks, for the CPU engine. Twins walk the lists of the state, where each of two grains in contact computes
//! it for itself; here a contact is computed once. Grains are worked on in blocks, in the order in which they are sorted.
//! A block copies its grains and those of other blocks that may touch them into one place, and goes through the pairs of
//! these, many at a time. A pair of two blocks is computed by both.
//!
//! Pairs are in the order of the numbers of their grains, first those of the grain with the smallest number. So what acts
//! on a grain is added up in the order of its list, and the bits are those of the twins, whatever the blocks are.
//!
//! What contacts remember is here while steps are done, and put back into the state before anybody else looks.

use super::{
    batch::{Grain, LANES, MOST_GRAINS, OfGrains, Pairs, Rows, ZERO, at, set},
    history::{History, Lists, history_of, with_lists},
    law::{Contact, contact_with},
    materials::pair_index,
    rolling::RollingHistory,
    tangential::TangentialHistory,
};
use crate::{
    body::{Body, blocks::BLOCK},
    model::{History as Memory, Materials, Rolling},
    state::{ACTIVE, Array, INDEX, Length, NONE, State, array},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::{cell::RefCell, ops::Range, thread::LocalKey};

/// Bytes of blocks per entry of the lists, measured.
pub const BYTES_PER_ENTRY: u64 = 40;

/// The blocks of a state.
#[derive(Default)]
pub struct Blocks {
    blocks: Vec<Block>,
    /// Whether they are those of the present lists.
    current: bool,
    /// Whether contacts here remember more than those of the state.
    ahead: bool,
}

/// Whether it says who may touch whom, or what contacts remember.
fn is_of_lists(array: &Array) -> bool {
    *array == array::LIST_START || array.length == Length::Entries
}

impl Blocks {
    /// The lists of the state are new.
    pub fn discard(&mut self) {
        self.current = false;
    }

    /// An array of the state is about to get another content.
    pub fn forget(&mut self, s: &mut State, array: &Array) {
        if is_of_lists(array) {
            self.put_back(s);
            self.discard();
        }
    }

    /// An array of the state is about to be read.
    pub fn show(&mut self, s: &mut State, array: &Array) {
        if is_of_lists(array) {
            self.put_back(s);
        }
    }

    /// What contacts remember, into the lists of the state.
    pub fn put_back(&mut self, s: &mut State) {
        if std::mem::take(&mut self.ahead) && self.current {
            let blocks = self.blocks.par_iter();
            with_lists(s, blocks, |_, _, block, mut lists| block.put_back(&mut lists), |(), ()| (), || ());
        }
    }

    /// Blocks of the present lists.
    pub fn update(&mut self, s: &State) {
        if !self.current {
            let bodies = s.sizes.bodies;
            self.blocks.resize_with(bodies.div_ceil(BLOCK), Block::default);
            let renew = |(k, block): (usize, &mut Block)| block.renew(s, k * BLOCK..((k + 1) * BLOCK).min(bodies));
            self.blocks.par_iter_mut().enumerate().with_max_len(1).for_each(renew);
            self.current = true;
        }
    }

    /// Contacts are about to remember more than in the lists of the state.
    pub fn get_ahead(&mut self) {
        self.ahead = true;
    }

    /// Do a task on each of them.
    pub fn run<T: Task>(
        &mut self,
        s: &State,
        workspace: &'static LocalKey<RefCell<Workspace<T::Sum>>>,
        tasks: impl IndexedParallelIterator<Item = T>,
    ) -> impl ParallelIterator<Item = T::Output> {
        let run = move |(task, block)| {
            workspace.with_borrow_mut(|workspace| Arch::new().dispatch(OnBlock { s, block, workspace, task }))
        };
        tasks.zip(&mut self.blocks).with_max_len(1).map(run) // so that no thread waits for several of another
    }

    /// Contacts that are in no batch of pairs, each with the number in memory of its grain.
    pub fn singles(&self) -> impl ParallelIterator<Item = (usize, &Single)> {
        self.blocks
            .par_iter()
            .flat_map_iter(|block| block.single.iter().map(|one| (block.grains.start + one.grain as usize, one)))
    }

    /// Active contacts, as far as lists tell them.
    pub fn active_contacts(&mut self, s: &State) -> u32 {
        if s.model.history == Memory::None {
            return 0;
        }
        self.update(s);
        self.blocks.par_iter().map(|block| block.active_sides(s)).sum::<u32>() / 2
    }
}

/// What is done with a block. It is compiled for the vectors that machines have, with all that is inlined into it.
pub trait Task: Send {
    /// What is summed up for each grain.
    type Sum: Copy + Default;
    type Output: Send;

    fn run(self, s: &State, block: &mut Block, workspace: &mut Workspace<Self::Sum>) -> Self::Output;
}

struct OnBlock<'a, T: Task> {
    s: &'a State,
    block: &'a mut Block,
    workspace: &'a mut Workspace<T::Sum>,
    task: T,
}

impl<T: Task> WithSimd for OnBlock<'_, T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> T::Output {
        self.task.run(self.s, self.block, self.workspace)
    }
}

/// What a thread computes in: the grains of a block and of its halo, and the sums of each.
pub struct Workspace<T> {
    pub grains: Box<OfGrains<Grain>>,
    pub sums: Box<OfGrains<T>>,
}

impl<T: Copy + Default> Default for Workspace<T> {
    fn default() -> Workspace<T> {
        fn boxed<T: Copy + Default>() -> Box<OfGrains<T>> {
            vec![T::default(); MOST_GRAINS]
                .into_boxed_slice()
                .try_into()
                .unwrap_or_else(|_| unreachable!("it is as long"))
        }
        Workspace { grains: boxed(), sums: boxed() }
    }
}

/// A run of grains, and their contacts.
#[derive(Default)]
pub struct Block {
    pub grains: Range<usize>,
    /// Where their lists begin.
    first_entry: u32,
    /// The others that they may touch, in ascending order.
    halo: Vec<u32>,
    /// Pairs of grains, counted from the first of the run and on through the halo. Of each the first has the smaller
    /// number; in the last lanes a pair may be repeated that is not looked at there.
    pub pairs: Vec<Pairs>,
    /// Their entries in the lists of the block; none of grains of other blocks.
    entries: Vec<[u32; 2]>,
    /// Where their pairs of materials are in tables; empty if there is one material only.
    pub materials: Vec<[u32; LANES]>,
    pub is_active: Vec<[bool; LANES]>,
    pub force: Vec<Rows>,
    /// Empty if the model has no rolling resistance.
    pub torque: Vec<Rows>,
    /// Contacts that are computed one by one after these, in the order of the lists: those with walls, or all, if there
    /// are too many grains.
    pub single: Vec<Single>,
}

/// A contact of a grain with a neighbour, as in the lists.
pub struct Single {
    pub grain: u32,
    pub other: u32,
    entry: u32,
    pub is_active: bool,
    pub history: History,
}

impl Single {
    /// The contact now, of grain i.
    #[inline(always)]
    pub fn contact(&self, s: &State, i: usize, here: &Body) -> Contact {
        contact_with(s, i, here, self.other as usize, self.is_active, self.history)
    }

    #[inline(always)]
    pub fn remember(&mut self, contact: &Contact) {
        self.is_active = contact.is_active;
        self.history = if contact.is_active { contact.history } else { History::default() };
    }
}

/// To sort by a number, and then by what it is of.
fn key(number: u32, of: usize) -> u64 {
    u64::from(number) << 32 | of as u64
}

impl Block {
    /// Becomes the block of these grains, in the memory that it has.
    fn renew(&mut self, s: &State, grains: Range<usize>) {
        let row = |i: usize| s.row(i).take_while(|&entry| s.neighbour[entry] != NONE);
        let other = |entry: usize| (s.neighbour[entry] & INDEX) as usize;
        let is_grain = |&entry: &usize| other(entry) < s.sizes.bodies;
        self.clear(s, grains.clone());

        // Entries of grains of other blocks, by grain: in each run of a halo grain, the grains that may touch it.
        let own = grains.len();
        let mut across: Vec<u64> = Vec::new();
        for (k, i) in grains.clone().enumerate() {
            let others = row(i).filter(is_grain).map(other).filter(|j| !grains.contains(j));
            across.extend(others.map(|j| key(j as u32, k)));
        }
        across.sort_unstable();
        let across: Vec<&[u64]> = across.chunk_by(|a, b| a >> 32 == b >> 32).collect();
        if own + across.len() > MOST_GRAINS {
            grains.for_each(|i| row(i).for_each(|entry| self.push_single(s, i, entry)));
            return;
        }
        self.halo.extend(across.iter().map(|run| (run[0] >> 32) as u32));

        // Grain by grain in the order of the numbers, each with those of larger numbers. So the next pair of a grain is
        // always that of its next entry.
        let all = grains.clone().chain(self.halo.iter().map(|&j| j as usize));
        let mut order: Vec<u64> = all.enumerate().map(|(k, j)| key(s.id[j], k)).collect();
        order.sort_unstable();
        let mut next: Vec<usize> = grains.clone().map(|i| s.list_start[i] as usize).collect();
        for (id, first) in order.into_iter().map(|key| ((key >> 32) as u32, key as u16)) {
            if let Some(run) = usize::from(first).checked_sub(own) {
                for second in across[run].iter().map(|key| *key as u16) {
                    let k = usize::from(second);
                    if s.id[grains.start + k] > id {
                        self.push(s, [first, second], [None, Some(next[k])]);
                        next[k] += 1;
                    }
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
                    self.push(s, [first, second as u16], [Some(entry), Some(next[second])]);
                    next[second] += 1;
                } else {
                    let run = self.halo.partition_point(|&k| (k as usize) < j);
                    self.push(s, [first, (own + run) as u16], [Some(entry), None]);
                }
            }
        }
        for i in grains {
            row(i).filter(|entry| !is_grain(entry)).for_each(|entry| self.push_single(s, i, entry));
        }
    }

    /// These grains, without neighbours.
    fn clear(&mut self, s: &State, grains: Range<usize>) {
        self.first_entry = s.list_start[grains.start];
        self.grains = grains;
        self.halo.clear();
        self.pairs.clear();
        self.entries.clear();
        self.materials.clear();
        self.is_active.clear();
        self.force.clear();
        self.torque.clear();
        self.single.clear();
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
            self.pairs.push([a, b].map(|grain| [grain; LANES]));
            self.is_active.push([false; LANES]);
            self.force.push(ZERO);
            self.torque.extend((s.model.rolling != Rolling::None).then_some(ZERO));
            self.materials.extend((s.model.materials == Materials::Many).then_some([0; LANES]));
        }
        self.entries.push(entries.map(|entry| entry.map_or(NONE, |entry| entry as u32 - self.first_entry)));
        (self.pairs[group][0][lane], self.pairs[group][1][lane]) = (a, b);
        let of_pair = pair_index(s, self.body(a), self.body(b)) as u32;
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

    /// The number in memory of a grain that pairs name.
    pub fn body(&self, grain: u16) -> usize {
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

    /// Sides of active contacts that are grains of the block, or walls.
    fn active_sides(&self, s: &State) -> u32 {
        let of_pair = |(is_active, entries): (&bool, &[u32; 2])| {
            u32::from(*is_active) * entries.iter().map(|entry| u32::from(*entry != NONE)).sum::<u32>()
        };
        let of_single =
            |one: &Single| u32::from(one.is_active) * if one.other as usize >= s.sizes.bodies { 2 } else { 1 };
        self.is_active.as_flattened().iter().zip(&self.entries).map(of_pair).sum::<u32>()
            + self.single.iter().map(of_single).sum::<u32>()
    }

    /// Copy the grains of the block and its halo, and have nothing summed up for them yet.
    #[inline(always)]
    pub fn begin<T: Copy + Default>(&self, s: &State, Workspace { grains, sums }: &mut Workspace<T>) {
        let own = self.grains.len();
        for (grain, i) in grains.iter_mut().zip(self.grains.clone()) {
            grain.set(s, i);
        }
        for (grain, j) in grains[own..].iter_mut().zip(&self.halo) {
            grain.set(s, *j as usize);
        }
        sums[..own + self.halo.len()].fill(T::default());
    }
    /// How many lanes of a group have a pair.
    #[inline(always)]
    pub fn lanes(&self, group: usize) -> usize {
        (self.entries.len() - group * LANES).min(LANES)
    }
}
