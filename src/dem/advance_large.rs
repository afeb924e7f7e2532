//! Twin of `shaders/dem/advance_large.wgsl`: what `advance` does, for the large grains.

use crate::{
    dem::advance::advance_bodies,
    state::{HALTED, State},
};

pub fn advance_large(s: &mut State) {
    if s.halt[0] < HALTED {
        advance_bodies(s, s.sizes.bodies - s.sizes.large..s.sizes.bodies);
    }
}
