//! Twin of `shaders/permute.wgsl`: grains into the order of the cells.

use crate::state::{Element, State};
use rayon::prelude::*;

pub fn permute(s: &mut State) {
    gather(&mut s.place_next, &s.place, &s.sorted);
    gather(&mut s.residue_next, &s.residue, &s.sorted);
    gather(&mut s.motion_next, &s.motion, &s.sorted);
    gather(&mut s.spin_next, &s.spin, &s.sorted);
    gather(&mut s.number_next, &s.number, &s.sorted);
    s.travel.fill(0.0);
}

fn gather<T: Element + Copy>(to: &mut [T], from: &[T], sorted: &[u32]) {
    to.par_iter_mut().zip(sorted).for_each(|(to, &k)| *to = from[k as usize]);
}
