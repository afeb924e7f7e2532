//! Twin of `shaders/neighbours/displacement_check.wgsl`: how far grains went in a chunk, and how
//! many contacts have a history.

use crate::{contact::history::active_contacts, space::dimension::largest, state::State};
use rayon::prelude::*;

pub fn displacement_check(s: &mut State) {
    if !s.lists_fit() {
        return;
    }
    let of_body = |i: usize| {
        let displacement = (s.displacement[i] / s.params.displacement_limit) as f32;
        let coordinate: f64 = largest(s.position[i].x) * s.params.inverse_quantum;
        (displacement.to_bits(), (coordinate as f32).to_bits(), active_contacts(s, i).count() as u32)
    };
    let bodies = (0..s.sizes.bodies).into_par_iter();
    let (displacement, coordinate, count) =
        bodies.map(of_body).reduce(|| (0, 0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1), a.2 + b.2));
    s.counters[0].max_coordinate = s.counters[0].max_coordinate.max(coordinate);
    s.counters[0].max_displacement = s.counters[0].max_displacement.max(displacement);
    s.counters[0].active_contacts += count;
}
