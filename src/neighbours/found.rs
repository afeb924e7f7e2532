//! `count_neighbours` and `fill_neighbours` on the CPU engine, where one search is enough for both: what is near enough to
//! be counted is kept, and looked through again when lists are filled.

use super::{
    count_neighbours::{entries_besides, note_lost},
    fill_neighbours::fill_lists,
    grid::{counting_slack, search},
    levels::level_of,
};
use crate::{body::blocks::BLOCK, contact::geometry::closer_than, state::State};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// What the last search has found.
#[derive(Default)]
pub struct Found(Vec<Run>);

/// The grains that are near each of a run of grains, one list after the other.
#[derive(Default)]
struct Run {
    near: Vec<u32>,
    /// Of each list.
    end: Vec<u32>,
}

/// Stands in for the twin of `count_neighbours` where every list is a slice.
pub fn count_neighbours(found: &mut Found, s: &mut State) {
    let mut list_start = std::mem::take(&mut s.list_start);
    found.0.resize_with(s.sizes.bodies.div_ceil(BLOCK), Run::default);
    let runs = found.0.par_iter_mut().zip(list_start[..s.sizes.bodies].par_chunks_mut(BLOCK)).enumerate();
    let search = |(k, (run, entries)): (usize, (&mut Run, &mut [u32]))| {
        Arch::new().dispatch(Search { s, first: k * BLOCK, run, entries })
    };
    let lost = runs.map(search).max().unwrap_or(0);
    s.list_start = list_start;
    note_lost(s, lost);
}

/// Stands in for the twin of `fill_neighbours` after it.
pub fn fill_neighbours(found: &Found, s: &mut State) {
    fill_lists(s, |s, i, list| {
        let (run, k) = (&found.0[i / BLOCK], i % BLOCK);
        let begin = if k == 0 { 0 } else { run.end[k - 1] as usize };
        let mut filled = 0;
        for &j in &run.near[begin..run.end[k] as usize] {
            if closer_than(s, &s.position[i], &s.position[j as usize], s.params.margin) {
                list[filled] = j;
                filled += 1;
            }
        }
        filled
    });
}

/// A task: what is near the grains of a run, and how many entries each needs. It is compiled for the vectors that machines
/// have, which also round numbers without calling anybody.
struct Search<'a> {
    s: &'a State,
    first: usize,
    run: &'a mut Run,
    entries: &'a mut [u32],
}

impl WithSimd for Search<'_> {
    /// Mark of the first lost body.
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> u32 {
        let Search { s, first, run: Run { near, end }, entries } = self;
        let (mut found, mut lost) = (0, 0);
        end.clear();
        for (i, entries) in (first..).zip(entries) {
            let begin = found;
            let slack = counting_slack(&s.level[level_of(s, s.position[i].radius)]);
            search(s, i, s.params.margin + slack, |j, is_near| {
                if found == near.len() {
                    near.resize(2 * found + BLOCK, 0);
                }
                near[found] = j as u32;
                found += usize::from(is_near);
            });
            end.push(found as u32);
            let (besides, mark) = entries_besides(s, i);
            *entries = (found - begin) as u32 + besides;
            lost = lost.max(mark);
        }
        lost
    }
}
