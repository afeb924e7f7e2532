//! Twin of `shaders/drift.wgsl`: how far grains moved in this chunk.

use crate::{laws::boundary::separation, state::State};
use rayon::prelude::*;

pub fn drift(s: &mut State) {
    let drift = (0..s.sizes.bodies)
        .into_par_iter()
        .map(|i| {
            let moved = separation(s, s.place_before[i].x, s.place[i].x) / s.params.drift_limit;
            (moved.length_squared() as f32).to_bits()
        })
        .max();
    s.counters[0].drift = s.counters[0].drift.max(drift.unwrap_or(0));
}
