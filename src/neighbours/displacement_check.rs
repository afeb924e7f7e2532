//! Twin of `shaders/neighbours/displacement_check.wgsl`: how far grains went in a chunk, and how
//! many contacts have a history.

use crate::{
    contact::{blocks::Blocks, history::active_contacts},
    space::dimension::largest,
    state::{Position, State},
};
use rayon::prelude::*;

pub fn displacement_check(s: &mut State) {
    if !s.lists_fit() {
        return;
    }
    let of_body = |i: usize| active_contacts(s, i).count() as u32;
    s.counters[0].active_contacts += (0..s.sizes.bodies).into_par_iter().map(of_body).sum::<u32>();
    check_displacements(s);
}

/// The same, where blocks know of the contacts.
pub fn displacement_check_of_blocks(blocks: &mut Blocks, s: &mut State) {
    if s.lists_fit() {
        s.counters[0].active_contacts += blocks.active_contacts(s);
        check_displacements(s);
    }
}

fn check_displacements(s: &mut State) {
    let of_body = |(displacement, here): (&f64, &Position)| {
        let displacement = (displacement / s.params.displacement_limit) as f32;
        let coordinate: f64 = largest(here.x) * s.params.inverse_quantum;
        (displacement.to_bits(), (coordinate as f32).to_bits())
    };
    let bodies = s.displacement.par_iter().zip(&s.position);
    let (displacement, coordinate) = bodies.map(of_body).reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    s.counters[0].max_coordinate = s.counters[0].max_coordinate.max(coordinate);
    s.counters[0].max_displacement = s.counters[0].max_displacement.max(displacement);
}
