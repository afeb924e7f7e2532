//! Twin of `shaders/neighbours/lists/`: which bodies a workgroup serves that walks neighbour lists.

use crate::state::{GROUP, Sizes};
use std::ops::Range;

/// A large grain, which come last, in each of the first; many others in the rest.
pub fn bodies_of_group(sizes: &Sizes, group: usize) -> Range<usize> {
    let common = sizes.bodies - sizes.large;
    match group.checked_sub(sizes.large) {
        None => common + group..common + group + 1,
        Some(group) => group * GROUP..((group + 1) * GROUP).min(common),
    }
}

/// Whether a workgroup serves j, which may be a wall.
pub fn is_large(sizes: &Sizes, j: usize) -> bool {
    (sizes.bodies - sizes.large..sizes.bodies).contains(&j)
}
