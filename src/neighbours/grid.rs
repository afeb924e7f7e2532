//! Twin of `shaders/neighbours/grid.wgsl`: the hierarchical grid of the broad phase, whose levels wrap around.

use crate::{
    body::{blocks::BLOCK, grains::same_grain},
    contact::geometry::closer_than,
    model::Precision,
    neighbours::levels::level_of,
    space::dimension::cell_coordinates,
};
use crate::{
    space::boundary::{reduced, reduced_reach},
    state::{Level, Position, State},
};
use glam::{DVec3, IVec3, UVec3};
use rayon::prelude::*;

/// What is within reach by a hair is looked at too, so that rounding cannot hide a neighbour.
pub const HAIR: f64 = 1.001;

/// Cell of a place in the grid, by axis of the grid, before the grid wraps around; in the precision of the model: where a
/// grain lies on the border of two cells, rounding decides, and must decide as on the device.
#[inline(always)]
fn cell_of(s: &State, place: DVec3, level: &Level) -> IVec3 {
    let scaled = match s.model.precision {
        Precision::Single => (place.as_vec3() * level.inverse_cell.as_vec3()).as_dvec3(),
        Precision::Double => place * level.inverse_cell,
    };
    let at = cell_coordinates(scaled);
    IVec3::from_array(s.params.axes.to_array().map(|axis| at[axis as usize]))
}

#[inline(always)]
fn wrapped(c: IVec3, cells: UVec3) -> UVec3 {
    let size = cells.as_ivec3();
    ((c % size + size) % size).as_uvec3()
}

/// Cell of a grain, among the cells of all levels.
fn cell_index(s: &State, here: &Position) -> usize {
    let level = &s.level[level_of(s, here.radius)];
    let c = wrapped(cell_of(s, reduced(s, here.x), level), level.cells);
    (row_start(level, c.y, c.z) + c.x) as usize
}

/// The first cell of a row: strip by strip, and in each the second axis fastest.
#[inline(always)]
fn row_start(level: &Level, y: u32, z: u32) -> u32 {
    let begin = y & !(level.strip - 1);
    let width = level.strip.min(level.cells.y - begin);
    level.first_cell + level.cells.x * (begin * level.cells.z + z * width + (y - begin))
}

/// The cell of every grain.
pub fn cells(s: &State) -> Vec<usize> {
    s.position[..s.sizes.bodies].par_iter().map(|position| cell_index(s, position)).collect()
}

/// The spans of cells of a level that surround a grain: every row has two, what comes before the end of the row, and
/// what lies around the corner.
#[inline(always)]
pub fn for_spans(s: &State, here: &Position, level: &Level, mut visit: impl FnMut(std::ops::Range<u32>)) {
    let reach = reduced_reach(s, HAIR * (here.radius + level.radius + s.params.margin + s.params.position_slack));
    let place = reduced(s, here.x);
    let (lower, upper) = (cell_of(s, place - reach, level), cell_of(s, place + reach, level));
    let (first, cells) = (wrapped(lower, level.cells), level.cells);
    let count = ((upper - lower).as_uvec3() + UVec3::ONE).min(cells);
    let end = first.x + count.x;
    for z in first.z..first.z + count.z {
        for y in first.y..first.y + count.y {
            let begin = row_start(level, y % cells.y, z % cells.z);
            visit(begin + first.x..begin + end.min(cells.x));
            visit(begin..begin + end.max(cells.x) - cells.x);
        }
    }
}

/// The indices of the grains in the cells of a level that surround a grain; grains are in the order of the cells.
#[inline(always)]
pub fn for_candidates(s: &State, here: &Position, level: &Level, mut visit: impl FnMut(usize)) {
    for_spans(s, here, level, |span| {
        let grain = |cell: u32| s.cell_start[cell as usize] as usize;
        (grain(span.start)..grain(span.end)).for_each(&mut visit);
    });
}

/// The candidates for the list of grain i on its own level, each with whether it is closer than this, m. Which of them
/// are is hard to guess, so better take the answer as a number.
#[inline(always)]
pub fn search(s: &State, i: usize, gap: f64, mut visit: impl FnMut(usize, bool)) {
    let here = &s.position[i];
    for_candidates(s, here, &s.level[level_of(s, here.radius)], |j| {
        visit(j, closer_than(s, here, &s.position[j], gap) & !same_grain(s, i, j));
    });
}

/// The pairs of grains of two levels that are closer than lists reach, and by some slack more: in runs of finer grains.
pub fn pairs_across_levels(s: &State, slack: impl Fn(&Level) -> f64 + Sync) -> Vec<Vec<(usize, usize)>> {
    let coarser = |i: usize| s.level[level_of(s, s.position[i].radius) + 1..].iter();
    let of_run = |run: usize| {
        let mut pairs = Vec::new();
        for i in run * BLOCK..((run + 1) * BLOCK).min(s.sizes.bodies) {
            let here = &s.position[i];
            for level in coarser(i) {
                let reach = s.params.margin + slack(level);
                for_candidates(s, here, level, |j| {
                    if closer_than(s, here, &s.position[j], reach) && !same_grain(s, i, j) {
                        pairs.push((i, j));
                    }
                });
            }
        }
        pairs
    };
    (0..s.sizes.bodies.div_ceil(BLOCK)).into_par_iter().map(of_run).collect()
}

/// How much further than lists are filled their entries are counted, m, so that rounding can never make more of them
/// than were counted.
pub fn counting_slack(level: &Level) -> f64 {
    1e-5 * level.radius
}
