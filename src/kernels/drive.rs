//! Twin of `shaders/drive.wgsl`: what acts on the members of a clump moves and turns it.

use crate::{
    laws::{
        grains::{Moved, clump, count_rounds, gathered_by_clump, spins_in_scene},
        leapfrog::advanced,
        predictor_corrector::{Gain, gained, own_torque},
        rotation::spun,
    },
    state::{Spin, State},
};
use rayon::prelude::*;

pub fn drive(s: &mut State) {
    if s.halt[0] != 0 {
        return;
    }
    let next: Vec<(Moved, Option<Gain>)> =
        (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(|c| driven(s, c)).collect();
    for (c, (moved, gain)) in next.into_iter().enumerate() {
        moved.keep(s, c);
        if let Some(Gain { spin, rounds, settled }) = gain {
            s.spin_gain[c] = Spin(spin);
            count_rounds(s, rounds, settled);
        }
    }
}

fn driven(s: &State, c: usize) -> (Moved, Option<Gain>) {
    let here = clump(s, c);
    let sum = gathered_by_clump(s, c, here.attitude);
    let v = advanced(s, &here.motion, sum.force);
    let (mut spin, mut gain) = (here.spin, None);
    if !spins_in_scene(&s.model, here.inverse_moments) {
        let found = gained(s, &here, own_torque(&here, sum.torque), s.spin_gain[c].0);
        spin += found.spin;
        gain = Some(found);
    } else if here.motion.inverse_mass != 0.0 {
        spin = spun(s, spin, here.inverse_moments * sum.torque);
    }
    (Moved::of(s, c, &here, v, spin), gain)
}
