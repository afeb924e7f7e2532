//! Twin of `shaders/neighbours/grid.wgsl`: the wrapping grid of the broad phase.

use crate::{body::grains::same_grain, contact::geometry::closer_than, space::dimension::cell_coordinates};
use crate::{
    model::{Grains, Precision},
    state::State,
};
use glam::{DVec3, IVec3, UVec3};
use rayon::prelude::*;

/// Cell of a point, by axis of the grid, in the precision of the model: where a grain lies on the border of two cells,
/// rounding decides, and must decide as on the device.
#[inline(always)]
pub fn cell_of(s: &State, x: DVec3) -> UVec3 {
    let size = s.params.cells.as_ivec3();
    let scaled = match s.model.precision {
        Precision::Single => {
            ((x.as_vec3() - s.params.cell_origin.as_vec3()) * s.params.inverse_cell.as_vec3()).as_dvec3()
        }
        Precision::Double => (x - s.params.cell_origin) * s.params.inverse_cell,
    };
    let at = cell_coordinates(scaled);
    let c = s.params.axes.to_array().map(|axis| at[axis as usize]);
    let c = IVec3::from_array(c) % size;
    ((c + size) % size).as_uvec3()
}

/// Position of a cell in the arrays.
pub fn cell_index(s: &State, c: UVec3) -> usize {
    (c.x + s.params.cells.x * (c.y + s.params.cells.y * c.z)) as usize
}

/// Coordinates along an axis of the cells around a cell, itself included; an axis of one or two cells is walked once.
fn along(s: &State, c: UVec3, axis: usize) -> impl Iterator<Item = u32> {
    let cells = s.params.cells[axis];
    let around = if cells < 3 { [0, 1, 2] } else { [c[axis] + cells - 1, c[axis], c[axis] + 1].map(|at| at % cells) };
    around.into_iter().take(cells.min(3) as usize)
}

/// The indices of the grains in the cells around a point; the grains are in the order of the cells. Every row of cells
/// has two spans: the cells next to the point's, and what lies around the corner if that is at an end of the row.
#[inline(always)]
pub fn for_candidates(s: &State, x: DVec3, mut visit: impl FnMut(usize)) {
    let (c, size) = (cell_of(s, x), s.params.cells);
    let spans = match c.x {
        _ if size.x < 3 => [0..size.x, 0..0],
        0 => [0..2, size.x - 1..size.x],
        x if x == size.x - 1 => [x - 1..size.x, 0..1],
        x => [x - 1..x + 2, 0..0],
    };
    for z in along(s, c, 2) {
        for y in along(s, c, 1) {
            let row = size.x * (y + size.y * z);
            for span in &spans {
                let grain = |cell: u32| s.cell_start[(row + cell) as usize] as usize;
                (grain(span.start)..grain(span.end)).for_each(&mut visit);
            }
        }
    }
}

/// The candidates for the list of grain i, each with whether it is closer than this, m. Which of them are is hard to
/// guess, so better take the answer as a number.
#[inline(always)]
pub fn search(s: &State, i: usize, gap: f64, mut visit: impl FnMut(usize, bool)) {
    let here = &s.position[i];
    let fixed = s.velocity[i].inverse_mass == 0.0;
    for_candidates(s, here.x, |j| {
        let pinned = fixed && s.velocity[j].inverse_mass == 0.0;
        let apart = s.model.grains == Grains::Spheres || !same_grain(s, i, j);
        visit(j, closer_than(s, here, &s.position[j], gap) & (j != i) & !pinned && apart);
    });
}

/// The cell of every grain.
pub fn cells(s: &State) -> Vec<usize> {
    s.position[..s.sizes.bodies].par_iter().map(|position| cell_index(s, cell_of(s, position.x))).collect()
}
