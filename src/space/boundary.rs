//! Twin of `shaders/space/boundary/`.

use crate::space::precision::{Point, displaced};
use crate::{model::Boundary, state::State};
use glam::DVec3;

/// From a to (the nearest image of) b + low part: the part that is exact, and the rest.
#[inline(always)]
pub fn nearest_image(s: &State, a: DVec3, b: DVec3, low: DVec3) -> Point {
    let d = b - a;
    let k = match s.model.boundary {
        Boundary::Open => None,
        Boundary::Periodic => periods(d * s.params.inverse_period + DVec3::splat(0.5)),
    };
    k.map_or(Point { x: d, low }, |k| Point { x: d - s.params.period * k, low: low - s.params.period_low * k })
}

/// The same of a difference in double precision, without a branch.
#[inline(always)]
pub fn nearest_image_of(s: &State, d: DVec3) -> DVec3 {
    d - s.params.period * (d * s.params.inverse_period + DVec3::splat(0.5)).floor()
}

/// The image of a point that lies in the domain, split anew.
#[inline(always)]
pub fn wrap(s: &State, p: Point) -> Point {
    let k = match s.model.boundary {
        Boundary::Open => None,
        Boundary::Periodic => periods((p.x - s.params.cell_origin) * s.params.inverse_period),
    };
    k.map_or(p, |k| displaced(s, p.x - s.params.period * k, p.low, -s.params.period_low * k))
}

/// The whole periods in `k`, if there are any: mostly there are none, and to see that takes one branch, as the numbers
/// from 0 to 1 are those with bits below those of 1.
#[inline(always)]
fn periods(k: DVec3) -> Option<DVec3> {
    let within = |k: f64| k.to_bits() < 1.0_f64.to_bits();
    if within(k.x) & within(k.y) & within(k.z) { None } else { Some(k.floor()) }
}
