//! Twin of `shaders/neighbours/permute.wgsl`: grains into the order of the cells.

use crate::{
    space::precision::{Point, requantised},
    state::{Element, State},
};
use rayon::prelude::*;

pub fn permute(s: &mut State) {
    gather(&mut s.position_next, &s.position, &s.sorted);
    gather(&mut s.position_low_next, &s.position_low, &s.sorted);
    for i in 0..s.position_low_next.len() {
        let point = requantised(s, Point { x: s.position_next[i].x, low: s.position_low_next[i].x });
        (s.position_next[i].x, s.position_low_next[i].x) = (point.x, point.low);
    }
    gather(&mut s.velocity_next, &s.velocity, &s.sorted);
    gather(&mut s.spin_next, &s.spin, &s.sorted);
    gather(&mut s.velocity_low_next, &s.velocity_low, &s.sorted);
    gather(&mut s.id_next, &s.id, &s.sorted);
    s.displacement.fill(0.0);
    s.id_next.iter().enumerate().for_each(|(i, id)| s.index_of_id[*id as usize] = i as u32);
}

fn gather<T: Element + Copy>(to: &mut [T], from: &[T], sorted: &[u32]) {
    to.par_iter_mut().zip(sorted).for_each(|(to, &k)| *to = from[k as usize]);
}
