//! Twin of `shaders/body/bodies.wgsl`.

use super::{Body, rotation::spin_of};
use crate::{space::precision::position_low_of, state::State};

/// Grain i.
#[inline(always)]
pub fn body(s: &State, i: usize) -> Body {
    Body { position: s.position[i], low: position_low_of(s, i), velocity: s.velocity[i], spin: spin_of(s, i) }
}
