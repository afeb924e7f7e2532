//! Twin of `shaders/nscd/coloring/priority.wgsl`: contacts of one colour share no grain.

use crate::{neighbours::lists::is_large, state::State};

/// Whether j is heavy beside small grains: a large one, a fixed one or a wall.
pub fn is_heavy(s: &State, j: usize) -> bool {
    j >= s.sizes.bodies || is_large(&s.sizes, j) || s.velocity[j].inverse_mass == 0.0
}

/// A rank of contacts on which two grains agree, and that neighbours in space do not share: so that many contacts are
/// the first of both of their grains. `a` and `b` are numbers of bodies, or bodies + w for wall w.
pub fn priority(a: u32, b: u32) -> u32 {
    let scaled = |x: u32, by: u32| (x + 1).wrapping_mul(by);
    let mut bits = scaled(a.min(b), 2_654_435_769).wrapping_add(scaled(a.max(b), 2_246_822_519));
    bits = (bits ^ (bits >> 15)).wrapping_mul(2_246_822_519);
    bits = (bits ^ (bits >> 13)).wrapping_mul(3_266_489_917);
    bits ^ (bits >> 16)
}
