//! Twin of `shaders/grid.wgsl`: the wrapping grid of the broad phase.

use super::dimension::cell_coordinates;
use crate::{model::Precision, state::State};
use glam::{DVec3, UVec3};
use std::ops::Range;

/// Cell of a point, in the precision of the model: where a grain lies on the border of two cells, rounding decides, and
/// must decide as on the device.
pub fn cell_of(s: &State, x: DVec3) -> UVec3 {
    let size = s.params.cells.as_ivec3();
    let scaled = match s.model.precision {
        Precision::Single => {
            ((x.as_vec3() - s.params.cell_origin.as_vec3()) * s.params.inverse_cell.as_vec3()).as_dvec3()
        }
        Precision::Double => (x - s.params.cell_origin) * s.params.inverse_cell,
    };
    let c = cell_coordinates(scaled) % size;
    ((c + size) % size).as_uvec3()
}

/// Position of a cell in the arrays.
pub fn cell_index(s: &State, c: UVec3) -> usize {
    (c.x + s.params.cells.x * (c.y + s.params.cells.y * c.z)) as usize
}

/// The spans of cells around a cell, itself included. Every row has two: the cells next to it, and what lies around the
/// corner if it is at an end of the row; an axis of one or two cells is walked once.
pub fn spans(s: &State, c: UVec3) -> impl Iterator<Item = Range<u32>> {
    let size = s.params.cells;
    let rows = (size.y.min(3), size.z.min(3));
    let along = move |axis: usize, step: u32| match size[axis] {
        ..3 => step,
        cells => (c[axis] + cells - 1 + step) % cells,
    };
    (0..rows.0 * rows.1).flat_map(move |k| {
        let begin = size.x * (along(1, k % rows.0) + size.y * along(2, k / rows.0));
        let (direct, corner) = match c.x {
            _ if size.x < 3 => (0..size.x, 0..0),
            0 => (0..2, size.x - 1..size.x),
            x if x == size.x - 1 => (x - 1..size.x, 0..1),
            x => (x - 1..x + 2, 0..0),
        };
        [direct, corner].map(|span| begin + span.start..begin + span.end)
    })
}

/// Indices of the grains in the cells around a point; the grains are in the order of the cells.
pub fn candidates(s: &State, x: DVec3) -> impl Iterator<Item = u32> {
    spans(s, cell_of(s, x)).flat_map(|cells| s.cell_start[cells.start as usize]..s.cell_start[cells.end as usize])
}
