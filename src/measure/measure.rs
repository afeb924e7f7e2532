//! Twin of `shaders/measure/measure.wgsl`: sums over free grains at step n, in an order that no
//! sorting changes.

use crate::{
    measure::body_sums::sums_of_bodies,
    state::{PartialSums, State},
};
use rayon::prelude::*;

pub fn measure(s: &mut State) {
    let of_bodies = sums_of_bodies(s);
    add_up(s, &of_bodies);
}

/// What the bodies have, in the order in which they lie in memory.
pub fn add_up(s: &mut State, of_bodies: &[PartialSums]) {
    let mut partial_sums = std::mem::take(&mut s.partial_sums);
    let rows = partial_sums.len();
    partial_sums.par_iter_mut().with_min_len(64).enumerate().for_each(|(p, partial_sums)| {
        *partial_sums = PartialSums::default();
        let numbers = (p..s.sizes.bodies).step_by(rows);
        numbers.for_each(|number| partial_sums.add(&of_bodies[s.index_of_id[number] as usize]));
    });
    s.partial_sums = partial_sums;
}
