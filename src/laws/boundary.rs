//! Twin of `shaders/boundary/`.

use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b, m.
pub fn separation(s: &State, a: DVec3, b: DVec3) -> DVec3 {
    let d = b - a;
    match s.model.boundary {
        Boundary::Open => d,
        Boundary::Periodic => {
            let k = (d * s.params.inverse_period + DVec3::splat(0.5)).floor();
            (d - s.params.period * k) - s.params.period_rest * k
        }
    }
}

/// Which image of the domain x lies in, in periods per axis.
pub fn image(s: &State, x: DVec3) -> DVec3 {
    match s.model.boundary {
        Boundary::Open => DVec3::ZERO,
        Boundary::Periodic => ((x - s.params.cell_origin) * s.params.inverse_period).floor(),
    }
}
