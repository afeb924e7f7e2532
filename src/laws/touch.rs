//! Twin of `shaders/touch.wgsl`: geometry of two grains.

use super::{Touch, boundary::separation, dimension::first_axis};
use crate::state::{Place, State};
use glam::DVec3;

/// Gap and normal from grain i to grain j; `residue` is that of j less that of i. Coincident centres get an arbitrary axis, opposite for the two grains.
pub fn touch_grain(s: &State, i: usize, j: usize, a: &Place, b: &Place, residue: DVec3) -> Touch {
    let d = separation(s, a.x, b.x) + residue;
    let distance = d.length();
    if distance == 0.0 {
        return Touch { gap: -(a.radius + b.radius), n: if i < j { first_axis() } else { -first_axis() } };
    }
    Touch { gap: distance - (a.radius + b.radius), n: d / distance }
}

/// Unit vector along d; the other one where d has no length.
pub fn unit_or(d: DVec3, other: DVec3) -> DVec3 {
    let length_squared = d.length_squared();
    if length_squared == 0.0 { other } else { d / length_squared.sqrt() }
}

/// Whether b belongs into the neighbour list of a; `slack` widens the reach a little.
pub fn listed(s: &State, a: &Place, b: &Place, slack: f64) -> bool {
    let d = separation(s, a.x, b.x);
    let reach = slack * (a.radius + b.radius + s.params.margin);
    d.length_squared() < reach * reach
}
