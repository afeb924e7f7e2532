//! Twin of `shaders/dem/measure_gain.wgsl`: adaptive damping 1, what all forces of the step do to free grains.

use crate::state::{HALTED, State};
use rayon::prelude::*;
use std::mem::take;

pub fn measure_gain(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let mut energy_gain = take(&mut s.energy_gain);
    let rows = energy_gain.len();
    energy_gain.par_iter_mut().with_min_len(64).enumerate().for_each(|(p, gain)| {
        *gain = (p..s.sizes.bodies).step_by(rows).map(|number| of_body(s, s.index_of_id[number] as usize)).sum();
    });
    s.energy_gain = energy_gain;
}

/// J; of a fixed body nothing.
fn of_body(s: &State, i: usize) -> f64 {
    let (before, v) = (s.velocity[i], s.velocity_next[i].v);
    if before.inverse_mass > 0.0 { 0.5 * (v - before.v).dot(v + before.v) / before.inverse_mass } else { 0.0 }
}

/// The largest of a body, J, if nothing cancelled.
pub fn largest_gain(s: &State) -> f64 {
    let of_body = |i: usize| {
        let (before, v) = (s.velocity[i], s.velocity_next[i].v);
        let gain = (v - before.v).length() * (v.length() + before.v.length());
        if before.inverse_mass > 0.0 { 0.5 * gain / before.inverse_mass } else { 0.0 }
    };
    (0..s.sizes.bodies).map(of_body).fold(0.0, f64::max)
}
