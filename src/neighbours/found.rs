//! `count_neighbours` and `fill_neighbours` on the CPU engine, where one search is enough for both: what is near enough to
//! be counted is kept, and looked through again when lists are filled.

use super::{
    count_neighbours::{entries_besides, note_lost},
    fill_neighbours::fill_lists,
    grid::{counting_slack, for_spans},
    levels::level_of,
};
use crate::{
    body::{blocks::BLOCK, grains::same_grain},
    contact::{batch::lanes_of, geometry::closer_than},
    model::Boundary,
    space::boundary::nearest_image_of,
    state::{Position, State},
};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

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
    let lost = runs.with_max_len(1).map(search).max().unwrap_or(0);
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
        let (mut spans, mut lost) = (Vec::new(), 0);
        near.clear();
        end.clear();
        for (i, entries) in (first..).zip(entries) {
            let begin = near.len();
            let slack = counting_slack(&s.level[level_of(s, s.position[i].radius)]);
            search(s, i, s.params.margin + slack, &mut spans, near);
            end.push(near.len() as u32);
            let (besides, mark) = entries_besides(s, i);
            *entries = (near.len() - begin) as u32 + besides;
            lost = lost.max(mark);
        }
        lost
    }
}

/// Grains looked at at a time: about as many as are in the cells of a row that surround a grain.
const LANES: usize = 8;

/// The grains on the level of grain i that are closer to it than this, m, in the order of the cells: as `grid::search`.
/// Spans of cells are noted first, so that the loop over grains is compiled into the task.
#[inline(always)]
fn search(s: &State, i: usize, gap: f64, spans: &mut Vec<Range<u32>>, near: &mut Vec<u32>) {
    let here = &s.position[i];
    spans.clear();
    for_spans(s, here, &s.level[level_of(s, here.radius)], |span| spans.push(span));
    for span in &*spans {
        let [mut begin, end] = [span.start, span.end].map(|cell| s.cell_start[cell as usize] as usize);
        while begin < end {
            let lanes = (end - begin).min(LANES);
            let are_near = match s.position[begin..].first_chunk() {
                Some(there) => match s.model.boundary {
                    Boundary::Open => are_closer_than(s, Boundary::Open, here, there, gap),
                    Boundary::Periodic => are_closer_than(s, Boundary::Periodic, here, there, gap),
                    Boundary::Deforming => are_closer_than(s, Boundary::Deforming, here, there, gap),
                },
                None => std::array::from_fn(|k| k < lanes && closer_than(s, here, &s.position[begin + k], gap)),
            };
            let others = lanes_of::<LANES>(lanes, |lane| are_near[lane]).map(|lane| begin + lane);
            near.extend(others.filter(|&j| !same_grain(s, i, j)).map(|j| j as u32));
            begin += lanes;
        }
    }
}

/// `closer_than`, in a loop that the compiler makes vectors of.
#[inline(always)]
fn are_closer_than(
    s: &State,
    boundary: Boundary,
    here: &Position,
    there: &[Position; LANES],
    gap: f64,
) -> [bool; LANES] {
    let mut are = [false; LANES];
    for (is, there) in are.iter_mut().zip(there) {
        let d = nearest_image_of(s, boundary, there.x - here.x);
        let reach = here.radius + there.radius + gap + s.params.position_slack;
        *is = d.length_squared() < reach * reach;
    }
    are
}
