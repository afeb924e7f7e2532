//! A step of the CPU engine: `advance` and `member_forces`, with contacts computed in blocks.

use super::{
    advance::{Next, NextOfBlock, Outcome, begin_step, end_step, is_beyond},
    member_forces::{Loads, LoadsOfBlock},
};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::{Limits, body},
    },
    contact::{
        batch::{Batch, Forces, Springs},
        blocks::{Block, Blocks, Task, Workspace},
    },
    state::{HALTED, State},
};
use rayon::prelude::*;
use std::cell::RefCell;

thread_local!(static WORKSPACE: RefCell<Workspace<ForceTorque>> = RefCell::default());

/// Stands in for the twins of `advance` and `advance_large`.
pub fn advance(blocks: &mut Blocks, s: &mut State) {
    if !begin_step(s) {
        s.halt_next[0] = HALTED;
        return;
    }
    let mut next = Next::take(s);
    let outcome = step(blocks, s, next.blocks(s));
    next.put(s);
    end_step(s, outcome);
}

/// Stands in for the twin of `member_forces`.
pub fn member_forces(blocks: &mut Blocks, s: &mut State) {
    if !begin_step(s) {
        return;
    }
    let mut loads = Loads::take(s);
    let outcome = step(blocks, s, loads.blocks(s));
    loads.put(s);
    end_step(s, outcome);
}

fn step<T: Pushed>(blocks: &mut Blocks, s: &State, grains: impl IndexedParallelIterator<Item = T>) -> Outcome {
    blocks.update(s);
    blocks.get_ahead();
    blocks.run(s, &WORKSPACE, grains.map(Push)).reduce(Outcome::default, Outcome::and)
}

/// A run of grains that contact forces act on.
trait Pushed: Send {
    /// Body i, the k-th of the run, gets the sum of the forces of its contacts, and is lost if its centre is beyond a wall.
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

/// The task: what contacts do to the grains of a block.
struct Push<T>(T);

impl<T: Pushed> Task for Push<T> {
    type Sum = ForceTorque;
    type Output = Outcome;

    #[inline(always)]
    fn run(self, s: &State, block: &mut Block, workspace: &mut Workspace<ForceTorque>) -> Outcome {
        let mut deep = add_contacts_of_grains(s, block, workspace);
        let (mut grains, mut limits) = (self.0, Limits::default());
        let mut single = block.single.iter_mut().peekable();
        for (k, sum) in workspace.sums[..block.grains.len()].iter_mut().enumerate() {
            let (i, mut crossed) = (block.grains.start + k, false);
            let here = body(s, i);
            while let Some(one) = single.next_if(|one| one.grain == k as u32) {
                let contact = one.contact(s, i, &here);
                one.remember(&contact);
                if contact.is_active {
                    sum.add(&contact);
                    crossed |= is_beyond(s, &here, one.other as usize, &contact);
                    deep |= contact.is_deep;
                }
            }
            limits = limits.and(grains.push(s, (i, k), &here, sum, crossed));
        }
        Outcome { limits, deep }
    }
}

/// Whether one of them is deep.
#[inline(always)]
fn add_contacts_of_grains(s: &State, block: &mut Block, workspace: &mut Workspace<ForceTorque>) -> bool {
    block.begin(s, workspace);
    let mut batch: Batch<Forces> = Batch::new(s);
    for (group, pairs) in block.pairs.iter().enumerate() {
        let (lanes, is_active) = (block.lanes(group), &mut block.is_active[group]);
        let (force, torque) = (&mut block.force[group], block.torque.get_mut(group));
        let mut springs = Springs { is_active, force, torque };
        batch.compute(s, &workspace.grains, pairs, block.materials.get(group), &mut springs);
        batch.contacts.add(pairs, lanes, springs.is_active, &mut workspace.sums);
    }
    batch.contacts.deep()
}
