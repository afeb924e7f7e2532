//! Twin of `shaders/space/boundary/`.

use crate::space::precision::Point;
use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b + low part: the part that is exact, and the rest.
#[inline(always)]
pub fn nearest_image(s: &State, a: DVec3, b: DVec3, low: DVec3) -> Point {
    let d = b - a;
    match s.model.boundary {
        Boundary::Open => Point { x: d, low },
        Boundary::Periodic => {
            let k = d * s.params.inverse_period + DVec3::splat(0.5);
            without_periods(s, Point { x: d, low }, k)
        }
    }
}

/// The image of a point that lies in the domain.
#[inline(always)]
pub fn wrap(s: &State, p: Point) -> Point {
    match s.model.boundary {
        Boundary::Open => p,
        Boundary::Periodic => without_periods(s, p, (p.x - s.params.cell_origin) * s.params.inverse_period),
    }
}

/// p less the whole periods in `k`. Mostly there are none, and then nothing is computed; to see that takes one branch,
/// as the numbers from 0 to 1 are those with bits below those of 1.
#[inline(always)]
fn without_periods(s: &State, p: Point, k: DVec3) -> Point {
    let within = |k: f64| k.to_bits() < 1.0_f64.to_bits();
    if within(k.x) & within(k.y) & within(k.z) {
        return p;
    }
    let k = k.floor();
    Point { x: p.x - s.params.period * k, low: p.low - s.params.period_low * k }
}
