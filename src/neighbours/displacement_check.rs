//! Twin of `shaders/neighbours/displacement_check.wgsl`: how far grains went in a chunk, and how
//! many contacts have a history.

use crate::{contact::history::active_contacts, state::State};
use rayon::prelude::*;

pub fn displacement_check(s: &mut State) {
    if s.list_start[s.sizes.bodies] as usize > s.neighbour.len() {
        return;
    }
    let of_body = |i| {
        (((s.displacement[i] / s.params.displacement_limit) as f32).to_bits(), active_contacts(s, i).count() as u32)
    };
    let bodies = (0..s.sizes.bodies).into_par_iter();
    let (displacement, count) = bodies.map(of_body).reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1 + b.1));
    s.counters[0].max_displacement = s.counters[0].max_displacement.max(displacement);
    s.counters[0].active_contacts += count;
}
