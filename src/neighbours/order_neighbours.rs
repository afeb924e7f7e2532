//! Twin of `shaders/neighbours/order_neighbours.wgsl`: the entries of all but the large grains in ascending order of the
//! ids, then walls, and what contacts remember.

use crate::{neighbours::entries::order, state::State};

pub fn order_neighbours(s: &mut State) {
    order(s, 0..s.sizes.bodies - s.sizes.large);
}
