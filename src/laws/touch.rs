//! Twin of `shaders/touch.wgsl`: geometry of two grains.

use super::{
    Touch,
    boundary::between,
    dimension::first_axis,
    precision::{Point, gap_between},
};
use crate::state::{Place, State};
use glam::DVec3;

/// Gap and normal of grains i and j, between which lies `way`. Coincident centres get an arbitrary axis, opposite for the
/// two grains.
#[inline(always)]
pub fn touch_grain(s: &State, i: usize, j: usize, way: Point, a: f64, b: f64, radii_rest: f64) -> Touch {
    let d = way.x + way.residue;
    let distance = d.length();
    if distance == 0.0 {
        let n = if s.number[i] < s.number[j] { first_axis() } else { -first_axis() };
        return Touch { gap: -(a + b), n };
    }
    Touch { gap: gap_between(distance, a, b, radii_rest), n: d * (1.0 / distance) }
}

/// Unit vector along d; the other one where d has no length.
#[inline(always)]
pub fn unit_or(d: DVec3, other: DVec3) -> DVec3 {
    let length_squared = d.length_squared();
    if length_squared == 0.0 { other } else { d * (1.0 / length_squared.sqrt()) }
}

/// Whether the surfaces are closer than this, m, judged without residues: true where these could decide.
#[inline(always)]
pub fn within(s: &State, a: &Place, b: &Place, gap: f64) -> bool {
    let d = between(s, a.x, b.x, DVec3::ZERO).x;
    let reach = a.radius + b.radius + gap + s.params.blur;
    d.length_squared() < reach * reach
}
