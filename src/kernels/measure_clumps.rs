//! Twin of `shaders/measure_clumps.wgsl`: what free clumps add to the sums over their members.

use super::measure::add_energies;
use crate::{
    laws::grains::energies_of_clump,
    state::{PARTS, State},
};
use rayon::prelude::*;

pub fn measure_clumps(s: &mut State) {
    let mut part = std::mem::take(&mut s.part);
    part.par_iter_mut().enumerate().for_each(|(p, part)| {
        (p..s.sizes.clumps).step_by(PARTS).for_each(|c| add_energies(part, &energies_of_clump(s, c)));
    });
    s.part = part;
}
