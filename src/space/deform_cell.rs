//! Twin of `shaders/space/deform_cell.wgsl`: the periodic cell, n to n + 1, before bodies come to where it is then.

use crate::{
    space::{
        dimension::{excess_tilts, inverse_above, product_above, tilts_of, turned_back_by},
        precision::{Point, displaced, requantised},
    },
    state::{Cell, HALTED, Params, Spin, State},
};
use glam::DVec3;

pub fn deform_cell(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let next = deformed(s, &s.cell[0]);
    let narrow = |axis: usize| next.length[axis] != 0.0 && next.length[axis] < s.params.narrowest;
    if (0..3).any(narrow) {
        s.halt[0] = HALTED;
        s.counters[0].narrow_cell = 1;
        return;
    }
    s.cell_next[0] = next;
}

fn deformed(s: &State, cell: &Cell) -> Cell {
    let dt = s.params.dt;
    let length = requantised(s, Point { x: cell.length, low: cell.length_low });
    let tilt = requantised(s, Point { x: cell.tilt.0, low: cell.tilt_low.0 });
    let (rate, shear_rate) = (cell.rate_next, cell.shear_rate_next);
    let above = product_above(rate, shear_rate.0, cell.length, cell.tilt.0);
    let grown = displaced(s, length.x, length.low, dt * rate * cell.length);
    let sheared = displaced(s, tilt.x, tilt.low, dt * above);
    let count = excess_tilts(closed(cell.length, grown.x), sheared.x);
    let (whole, low) = (tilts_of(count, grown.x, sheared.x), tilts_of(count, grown.low, sheared.low));
    let turned = displaced(s, sheared.x - whole, sheared.low, -low);
    let turned_back = product_above(DVec3::ONE, turned_back_by(count), DVec3::ONE, cell.turned_back.0);
    let next = Cell {
        length: grown.x,
        length_low: grown.low,
        tilt: Spin(turned.x),
        tilt_low: Spin(turned.low),
        turned_back: Spin(turned_back),
        rate,
        shear_rate,
        ..*cell
    };
    stretched(&s.params, next)
}

/// Lengths along axes that are periodic. Open axes have no length, and nothing tilts along them.
fn closed(periodic: DVec3, length: DVec3) -> DVec3 {
    DVec3::select(periodic.cmpeq(DVec3::ZERO), DVec3::ONE, length)
}

/// A cell with what follows from its edges.
pub fn stretched(p: &Params, cell: Cell) -> Cell {
    let (period, edges) = (closed(cell.length, p.period), closed(cell.length, cell.length + cell.length_low));
    let inverse = inverse_above(edges, cell.tilt.0 + cell.tilt_low.0);
    Cell {
        stretch: period / edges,
        stretch_tilt: Spin(product_above(period, DVec3::ZERO, DVec3::ONE, inverse)),
        ..cell
    }
}
