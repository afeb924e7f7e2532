//! Twin of `shaders/neighbours/order_long_lists.wgsl`: the same of the large grains.

use crate::{neighbours::entries::order, state::State};

pub fn order_long_lists(s: &mut State) {
    order(s, s.sizes.bodies - s.sizes.large..s.sizes.bodies);
}
