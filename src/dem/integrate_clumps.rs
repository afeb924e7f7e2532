//! Twin of `shaders/dem/integrate_clumps.wgsl`: what acts on the members of a clump moves and turns it.

use crate::{
    body::{
        grains::{Moved, SpinIncrement, clump, clump_load, count_iterations, spins_in_scene},
        rotation::spin_change,
    },
    dem::{
        leapfrog::velocity_change,
        predictor_corrector::{own_torque, predictor_corrector},
    },
    state::{HALTED, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn integrate_clumps(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    let next: Vec<(Moved, Option<SpinIncrement>)> =
        (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(|c| driven(s, c)).collect();
    for (c, (moved, gain)) in next.into_iter().enumerate() {
        moved.store(s, c);
        if let Some(SpinIncrement { spin, rounds, settled }) = gain {
            s.spin_increment[c] = Spin(spin);
            count_iterations(s, rounds, settled);
        }
    }
}

fn driven(s: &State, c: usize) -> (Moved, Option<SpinIncrement>) {
    let here = clump(s, c);
    let sum = clump_load(s, c, here.orientation);
    let change = velocity_change(s, s.model.boundary, &here.velocity, sum.force);
    let (mut turned, mut gain) = (DVec3::ZERO, None);
    if !spins_in_scene(&s.model, here.inverse_moments) {
        let found = predictor_corrector(s, &here, own_torque(&here, sum.torque), s.spin_increment[c].0);
        turned = found.spin;
        gain = Some(found);
    } else if here.velocity.inverse_mass != 0.0 {
        turned = spin_change(s, here.spin, here.inverse_moments * sum.torque);
    }
    (Moved::of(s, c, &here, change, turned), gain)
}
