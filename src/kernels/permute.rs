//! Twin of `shaders/permute.wgsl`: grains into the order of the cells.

use crate::{
    model::Grains,
    state::{Element, State},
};
use rayon::prelude::*;

pub fn permute(s: &mut State) {
    gather(&mut s.place_next, &s.place, &s.sorted);
    gather(&mut s.residue_next, &s.residue, &s.sorted);
    gather(&mut s.motion_next, &s.motion, &s.sorted);
    gather(&mut s.spin_next, &s.spin, &s.sorted);
    gather(&mut s.number_next, &s.number, &s.sorted);
    s.travel.fill(0.0);
    keep_indices(s);
}

/// Where the bodies of all numbers are from now on.
fn keep_indices(s: &mut State) {
    if s.model.grains == Grains::Clumps {
        s.number_next.iter().enumerate().for_each(|(i, label)| s.whereabouts[*label as usize] = i as u32);
    }
}

fn gather<T: Element + Copy>(to: &mut [T], from: &[T], sorted: &[u32]) {
    to.par_iter_mut().zip(sorted).for_each(|(to, &k)| *to = from[k as usize]);
}
