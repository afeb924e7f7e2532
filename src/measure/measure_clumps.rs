//! Twin of `shaders/measure/measure_clumps.wgsl`: what free clumps add to the sums over their members.

use crate::measure::body_sums::add_energies;
use crate::{measure::energies::energies_of_clump, state::State};
use rayon::prelude::*;

pub fn measure_clumps(s: &mut State) {
    let mut partial_sums = std::mem::take(&mut s.partial_sums);
    let rows = partial_sums.len();
    partial_sums.par_iter_mut().enumerate().for_each(|(p, partial_sums)| {
        (p..s.sizes.clumps).step_by(rows).for_each(|c| add_energies(partial_sums, &energies_of_clump(s, c)));
    });
    s.partial_sums = partial_sums;
}
