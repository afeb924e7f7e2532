//! Twin of `shaders/boundary/`.

use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b, m.
pub fn separation(s: &State, a: DVec3, b: DVec3) -> DVec3 {
    let d = b - a;
    match s.model.boundary {
        Boundary::Open => d,
        Boundary::Periodic => d - s.params.period * (d * s.params.inverse_period + DVec3::splat(0.5)).floor(),
    }
}

/// The representative of x inside the domain.
pub fn wrap(s: &State, x: DVec3) -> DVec3 {
    match s.model.boundary {
        Boundary::Open => x,
        Boundary::Periodic => x - s.params.period * ((x - s.params.cell_origin) * s.params.inverse_period).floor(),
    }
}
