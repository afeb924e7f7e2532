//! Twin of `shaders/measure/measure.wgsl`: sums over free grains at step n, in an order that no
//! sorting changes.

use crate::{
    measure::body_sums::add_body,
    state::{PARTIAL_SUMS, PartialSums, State},
};
use rayon::prelude::*;

pub fn measure(s: &mut State) {
    let mut partial_sums = std::mem::take(&mut s.partial_sums);
    partial_sums.par_iter_mut().enumerate().for_each(|(p, partial_sums)| {
        *partial_sums = PartialSums::default();
        let numbers = (p..s.sizes.bodies).step_by(PARTIAL_SUMS);
        numbers.for_each(|number| add_body(s, s.index_of_id[number] as usize, partial_sums));
    });
    s.partial_sums = partial_sums;
}
