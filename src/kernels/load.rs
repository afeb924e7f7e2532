//! Twin of `shaders/load.wgsl`: contact forces at step n on every member of a clump.

use super::{
    BLOCK,
    advance::{Lists, Sums, pushed_by_grains, pushed_by_walls, row_in_block},
    by_body, by_slot,
};
use crate::{
    laws::contact::body,
    state::{Spin, State},
};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::mem::take;

pub fn load(s: &mut State) {
    if s.halt[0] != 0 {
        return;
    }
    s.counters[0].done += 1;
    let (mut pull, mut twist) = (take(&mut s.pull), take(&mut s.twist));
    let (mut neighbour, mut spring) = (take(&mut s.neighbour), take(&mut s.spring));
    let bad = by_body(&mut pull, s)
        .zip(by_body(&mut twist, s))
        .zip(by_slot(&mut neighbour, s))
        .zip(by_slot(&mut spring, s))
        .enumerate()
        .with_min_len(2)
        .map(|(k, (((pull, twist), neighbour), spring))| {
            let lists = Lists { neighbour, spring };
            Arch::new().dispatch(Work { s, first: k * BLOCK, pull, twist, lists })
        })
        .max()
        .unwrap_or(0);
    (s.pull, s.twist) = (pull, twist);
    (s.neighbour, s.spring) = (neighbour, spring);
    s.counters[0].bad_body = s.counters[0].bad_body.max(bad);
    s.halt_next[0] = s.halt_next[0].max(u32::from(bad != 0));
}

/// A task: what it reads and writes. It is compiled for the vectors that machines have.
struct Work<'a> {
    s: &'a State,
    first: usize,
    pull: &'a mut [DVec3],
    twist: &'a mut [Spin],
    lists: Lists<'a>,
}

impl WithSimd for Work<'_> {
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> u32 {
        let (s, first) = (self.s, self.first);
        let Sums { of_grains, first_wall } = pushed_by_grains(s, first, self.pull.len(), &mut self.lists);
        let mut bad = 0;
        for (k, (pull, twist)) in self.pull.iter_mut().zip(self.twist).enumerate() {
            let (i, mut sum) = (first + k, of_grains[k]);
            let walls = first_wall[k]..row_in_block(s, first, i).end;
            if pushed_by_walls(s, i, &body(s, i), walls, &mut self.lists, &mut sum) {
                bad = bad.max(s.params.bodies - s.number[i]);
            }
            (*pull, twist.0) = (sum.force, sum.torque);
        }
        bad
    }
}
