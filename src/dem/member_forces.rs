//! Twin of `shaders/dem/member_forces.wgsl`: contact forces at step n on every member of a clump.

use crate::{
    body::{
        ForceTorque,
        blocks::{BLOCK, by_body},
        bodies::{Limits, body},
    },
    contact::history::{Lists, with_lists},
    dem::advance::{BodyForces, Outcome, begin_step, contact_forces, end_step},
    state::{Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;
use std::mem::take;

pub fn member_forces(s: &mut State) {
    if !begin_step(s) {
        return;
    }
    let mut loads = Loads::take(s);
    let work = |s: &State, k: usize, mut loads: LoadsOfBlock, mut lists: Lists| {
        let (first, len) = (k * BLOCK, loads.force.len());
        let of_member = |i: usize| {
            let BodyForces { sum, crossed, deep } = contact_forces(s, first, i, &body(s, i), &mut lists);
            Outcome { limits: loads.store(s, (i, i - first), &sum, crossed), deep }
        };
        (first..first + len).map(of_member).fold(Outcome::default(), Outcome::and)
    };
    let blocks = loads.blocks(s);
    let outcome = with_lists(s, blocks, work, Outcome::and, Outcome::default);
    loads.put(s);
    end_step(s, outcome);
}

/// What acts on members, taken out of the state.
pub struct Loads {
    force: Vec<DVec3>,
    torque: Vec<Spin>,
}

/// What a task writes, of a run of members.
pub struct LoadsOfBlock<'a> {
    force: &'a mut [DVec3],
    torque: &'a mut [Spin],
}

impl Loads {
    pub fn take(s: &mut State) -> Loads {
        Loads { force: take(&mut s.member_force), torque: take(&mut s.member_torque) }
    }

    pub fn put(self, s: &mut State) {
        (s.member_force, s.member_torque) = (self.force, self.torque);
    }

    pub fn blocks<'a>(&'a mut self, s: &State) -> impl IndexedParallelIterator<Item = LoadsOfBlock<'a>> + use<'a> {
        by_body(&mut self.force, s)
            .zip(by_body(&mut self.torque, s))
            .map(|(force, torque)| LoadsOfBlock { force, torque })
    }
}

impl LoadsOfBlock<'_> {
    /// Of body i, the k-th of the run; it is lost if its centre is beyond a wall.
    #[inline(always)]
    pub fn store(&mut self, s: &State, (i, k): (usize, usize), sum: &ForceTorque, crossed: bool) -> Limits {
        (self.force[k], self.torque[k].0) = (sum.force, sum.torque);
        Limits { lost_body: if crossed { s.params.bodies - s.id[i] } else { 0 }, halt: crossed }
    }
}
