//! Twin of `shaders/touch.wgsl`: geometry of two grains.

use super::{Touch, boundary::between, dimension::first_axis, precision::gap_between};
use crate::state::{Place, State};
use glam::{BVec3, DVec3};

/// Gap and normal of two grains, between whose centres lies `way`.
#[inline(always)]
pub fn touch_grain(way: DVec3, a: f64, b: f64, radii_rest: f64) -> Touch {
    let distance = way.length();
    Touch { gap: gap_between(distance, a, b, radii_rest), n: way * (1.0 / distance) }
}

/// The way from grain i to grain j. Coincident centres are a hair apart along an arbitrary axis, opposite for the two
/// grains; the hair's square is still a number, and its root exact.
#[inline(always)]
pub fn apart(s: &State, i: usize, j: usize, way: DVec3) -> DVec3 {
    const HAIR: f64 = 3.054936363499605e-151; // 2^-500
    if way.length_squared() == 0.0 {
        return if s.number[i] < s.number[j] { HAIR * first_axis() } else { -HAIR * first_axis() };
    }
    way
}

/// Unit vector along d; the other one where d has no length.
#[inline(always)]
pub fn unit_or(d: DVec3, other: DVec3) -> DVec3 {
    let length_squared = d.length_squared();
    DVec3::select(BVec3::splat(length_squared == 0.0), other, d * (1.0 / length_squared.sqrt()))
}

/// Whether the surfaces are closer than this, m, judged without residues: true where these could decide.
#[inline(always)]
pub fn within(s: &State, a: &Place, b: &Place, gap: f64) -> bool {
    let d = between(s, a.x, b.x, DVec3::ZERO).x;
    let reach = a.radius + b.radius + gap + s.params.blur;
    d.length_squared() < reach * reach
}
