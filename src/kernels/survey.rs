//! Twin of `shaders/survey.wgsl`: how far grains went in a chunk, and how many springs there are.

use crate::{laws::friction::springs_kept, state::State};
use rayon::prelude::*;

pub fn survey(s: &mut State) {
    if s.slot_start[s.sizes.bodies] as usize > s.neighbour.len() {
        return;
    }
    let of_body = |i| (((s.travel[i] / s.params.drift_limit) as f32).to_bits(), springs_kept(s, i).count() as u32);
    let bodies = (0..s.sizes.bodies).into_par_iter();
    let (drift, springs) = bodies.map(of_body).reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1 + b.1));
    s.counters[0].drift = s.counters[0].drift.max(drift);
    s.counters[0].springs += springs;
}
