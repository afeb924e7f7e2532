//! Twin of `shaders/boundary/`.

use super::precision::Point;
use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b + residue: the part that is exact, and the rest.
pub fn between(s: &State, a: DVec3, b: DVec3, residue: DVec3) -> Point {
    let d = b - a;
    match s.model.boundary {
        Boundary::Open => Point { x: d, residue },
        Boundary::Periodic => {
            let k = (d * s.params.inverse_period + DVec3::splat(0.5)).floor();
            Point { x: d - s.params.period * k, residue: residue - s.params.period_rest * k }
        }
    }
}

/// The image of a point that lies in the domain.
pub fn wrapped(s: &State, p: Point) -> Point {
    match s.model.boundary {
        Boundary::Open => p,
        Boundary::Periodic => {
            let k = ((p.x - s.params.cell_origin) * s.params.inverse_period).floor();
            Point { x: p.x - s.params.period * k, residue: p.residue - s.params.period_rest * k }
        }
    }
}
