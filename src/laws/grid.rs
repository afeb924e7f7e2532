//! Twin of `shaders/grid.wgsl`: the wrapping grid of the broad phase.

use super::dimension::cell_coordinates;
use crate::{model::Precision, state::State};
use glam::{DVec3, UVec3};

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

/// Indices of the different cells that touch a cell, itself included; an axis of one or two cells is walked once.
pub fn around(s: &State, c: UVec3) -> impl Iterator<Item = usize> {
    let cells = s.params.cells;
    let ring = cells.min(UVec3::splat(3));
    (0..ring.x * ring.y * ring.z).map(move |k| {
        let step = UVec3::new(k % ring.x, (k / ring.x) % ring.y, k / (ring.x * ring.y));
        let moved = (c + cells - UVec3::ONE + step) % cells;
        cell_index(s, UVec3::select(cells.cmpge(UVec3::splat(3)), moved, step))
    })
}

/// Ids of the grains in the cells around a point.
pub fn candidates(s: &State, x: DVec3) -> impl Iterator<Item = u32> {
    around(s, cell_of(s, x)).flat_map(|c| &s.sorted[s.cell_start[c] as usize..s.cell_start[c + 1] as usize]).copied()
}
