//! Twin of `shaders/dem/member_forces.wgsl`: contact forces at step n on every member of a clump.

use crate::{
    body::blocks::{BLOCK, by_body, first_entry},
    contact::history::{Lists, with_lists},
    dem::advance::{Sums, forces_of_grains, forces_of_walls},
};
use crate::{
    body::bodies::body,
    state::{HALTED, Spin, State},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::mem::take;

pub fn member_forces(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    s.counters[0].steps_done += 1;
    s.halt_next[0] = s.halt[0] + 1;
    let (mut member_force, mut member_torque) = (take(&mut s.member_force), take(&mut s.member_torque));
    let loads = by_body(&mut member_force, s).zip(by_body(&mut member_torque, s));
    let work = |s: &State, k: usize, (member_force, member_torque), lists: Lists| {
        Arch::new().dispatch(Work { s, first: k * BLOCK, member_force, member_torque, lists })
    };
    let bad = with_lists(s, loads, work, u32::max, || 0);
    (s.member_force, s.member_torque) = (member_force, member_torque);
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
    if bad != 0 {
        s.halt_next[0] = HALTED;
    }
}

/// A task: what it reads and writes. It is compiled for the vectors that machines have.
struct Work<'a> {
    s: &'a State,
    first: usize,
    member_force: &'a mut [DVec3],
    member_torque: &'a mut [Spin],
    lists: Lists<'a>,
}

impl WithSimd for Work<'_> {
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> u32 {
        let (s, first) = (self.s, self.first);
        let Sums { of_grains, first_wall } =
            forces_of_grains(s, first, first..first + self.member_force.len(), &mut self.lists);
        let (mut bad, begin) = (0, first_entry(s, first));
        for (k, (member_force, member_torque)) in self.member_force.iter_mut().zip(self.member_torque).enumerate() {
            let (i, mut sum) = (first + k, of_grains[k]);
            let walls = s.row(i).from(begin).skip(first_wall[k]);
            if forces_of_walls(s, i, &body(s, i), walls, &mut self.lists, &mut sum) {
                bad = bad.max(s.params.bodies - s.id[i]);
            }
            (*member_force, member_torque.0) = (sum.force, sum.torque);
        }
        bad
    }
}
