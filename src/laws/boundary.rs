//! Twin of `shaders/boundary/`.

use super::precision::Point;
use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b + residue: the part that is exact, and the rest.
#[inline(always)]
pub fn between(s: &State, a: DVec3, b: DVec3, residue: DVec3) -> Point {
    let d = b - a;
    match s.model.boundary {
        Boundary::Open => Point { x: d, residue },
        Boundary::Periodic => {
            let k = d * s.params.inverse_period + DVec3::splat(0.5);
            unwound(s, Point { x: d, residue }, k)
        }
    }
}

/// The image of a point that lies in the domain.
#[inline(always)]
pub fn wrapped(s: &State, p: Point) -> Point {
    match s.model.boundary {
        Boundary::Open => p,
        Boundary::Periodic => unwound(s, p, (p.x - s.params.cell_origin) * s.params.inverse_period),
    }
}

/// p less the whole periods in `k`. Mostly there are none, and then nothing is computed; to see that takes one branch, as
/// the numbers from 0 to 1 are those with bits below those of 1.
#[inline(always)]
fn unwound(s: &State, p: Point, k: DVec3) -> Point {
    let within = |k: f64| k.to_bits() < 1.0_f64.to_bits();
    if within(k.x) & within(k.y) & within(k.z) {
        return p;
    }
    let k = k.floor();
    Point { x: p.x - s.params.period * k, residue: p.residue - s.params.period_rest * k }
}
