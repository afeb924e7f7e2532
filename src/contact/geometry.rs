//! Twin of `shaders/contact/geometry.wgsl`: geometry of two grains.

pub use crate::space::dimension::Separation;
use crate::{
    space::{
        boundary::nearest_image,
        dimension::first_axis,
        precision::{gap_between, position_low_of},
    },
    state::{Position, State},
};
use glam::{BVec3, DVec3};

/// Gap and normal of two grains with this branch vector, from centre to centre.
#[inline(always)]
pub fn sphere_separation(branch: DVec3, a: f64, b: f64, radii_rest: f64) -> Separation {
    let distance = branch.length();
    Separation { gap: gap_between(distance, a, b, radii_rest), n: branch * (1.0 / distance) }
}

/// From the centre of a grain to that of another; `ordered` if the other has the larger number. Coincident centres are a
/// hair apart along an arbitrary axis, opposite for the two grains; the hair's square is still a number, and its root
/// exact.
#[inline(always)]
pub fn separated(ordered: bool, branch: DVec3) -> DVec3 {
    const HAIR: f64 = 3.054936363499605e-151; // 2^-500
    if branch.length_squared() == 0.0 {
        return if ordered { HAIR * first_axis() } else { -HAIR * first_axis() };
    }
    branch
}

/// Unit vector along d; the other one where d has no length.
#[inline(always)]
pub fn unit_or(d: DVec3, other: DVec3) -> DVec3 {
    let length_squared = d.length_squared();
    DVec3::select(BVec3::splat(length_squared == 0.0), other, d * (1.0 / length_squared.sqrt()))
}

/// Whether the surfaces are closer than this, m, judged without low parts: true where these could decide.
#[inline(always)]
pub fn closer_than(s: &State, a: &Position, b: &Position, gap: f64) -> bool {
    let d = nearest_image(s, a.x, b.x, DVec3::ZERO).x;
    let reach = a.radius + b.radius + gap + s.params.position_slack;
    d.length_squared() < reach * reach
}

/// Whether the neighbour may act: an answer without low parts, for the price of one place.
#[inline(always)]
pub fn near(s: &State, here: &Position, j: usize) -> bool {
    s.position.get(j).is_none_or(|there| closer_than(s, here, there, s.params.reach))
}

/// From the centre of grain i to that of grain j, m.
#[inline(always)]
pub fn branch_vector(s: &State, i: usize, j: usize) -> DVec3 {
    let branch = nearest_image(s, s.position[i].x, s.position[j].x, position_low_of(s, j).x - position_low_of(s, i).x);
    separated(s.id[i] < s.id[j], branch.x + branch.low)
}

/// Whether surfaces overlap by more than is expected of grains, of which the smaller has this radius.
#[inline(always)]
pub fn is_deep(s: &State, gap: f64, radius: f64) -> bool {
    -gap > s.params.deep_overlap * radius
}

/// |branch + step| - |branch|, m, with the digits that this subtraction would lose.
#[inline(always)]
pub fn lengthened(branch: DVec3, step: DVec3) -> f64 {
    (2.0 * branch.dot(step) + step.length_squared()) / (branch.length() + (branch + step).length())
}
