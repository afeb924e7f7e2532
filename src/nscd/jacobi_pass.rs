//! Twin of `shaders/nscd/jacobi_pass.wgsl`: a pass. Every contact takes a step of Jacobi's kind from the impulses and
//! velocities that momentum has carried ahead, and every grain gathers what its contacts do to it.

use crate::body::blocks::{BLOCK, by_entry, first_entry};
use crate::{
    body::ForceTorque,
    model::Grains,
    nscd::{
        compliance::{compliance_at, compliant, compliant_work},
        contact::{active_entries, add_impulse, oriented_contact, store_residual_sums},
        response::{extrapolated_velocity_of, kinetic_metric, natural_map_scale, response, store_member_load},
    },
    solve::natural_map::{disc_update, natural_map, scaled_product},
    state::{Packed, ResidualSums, Spin, State},
};
use rayon::prelude::*;

pub fn jacobi_pass(s: &mut State) {
    if s.model.grains == Grains::Clumps {
        let (impulses, sums): (Vec<ForceTorque>, Vec<ResidualSums>) =
            passes(s, jacobi_pass_of, |_, _, sum, sums| (sum, sums)).into_iter().unzip();
        store_residual_sums(s, |_, i| sums[i]);
        return store_member_load(s, impulses.into_iter());
    }
    let responses = passes(s, jacobi_pass_of, |s, i, sum, sums| {
        let ((velocity, spin), (v, w)) = (response(s, i, &sum), extrapolated_velocity_of(s, i));
        let curvature = kinetic_metric(s, i, velocity.inverse_mass, velocity.v - v, spin - w);
        (velocity, spin, ResidualSums { curvature: sums.curvature + curvature, ..sums })
    });
    store_residual_sums(s, |_, i| responses[i].2);
    for (i, (velocity, spin, _)) in responses.into_iter().enumerate() {
        s.pass_velocity_before[i] = velocity;
        if let Some(kept) = s.pass_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// A pass over the contacts of all bodies, `of_body` after body, and what becomes of each body's impulses and sums.
pub fn passes<T: Send>(
    s: &mut State,
    of_body: impl Fn(&State, usize, &mut [Packed], usize) -> (ForceTorque, ResidualSums) + Sync,
    then: impl Fn(&State, usize, ForceTorque, ResidualSums) -> T + Sync,
) -> Vec<T> {
    let mut before = std::mem::take(&mut s.impulse_before);
    let of_bodies = by_entry(&mut before, s)
        .enumerate()
        .flat_map_iter(|(k, before)| {
            let first = k * BLOCK;
            let begin = first_entry(s, first);
            let bodies = first..(first + BLOCK).min(s.sizes.bodies);
            let result = |i| {
                let (sum, sums) = of_body(s, i, before, begin);
                then(s, i, sum, sums)
            };
            bodies.map(result).collect::<Vec<_>>()
        })
        .collect();
    s.impulse_before = before;
    of_bodies
}

/// Sum and moment of the impulses that grain i gets from a pass; `before` has those of the pass before from entry
/// `begin` on, and gets those of this one.
fn jacobi_pass_of(s: &State, i: usize, before: &mut [Packed], begin: usize) -> (ForceTorque, ResidualSums) {
    let (step, beta) = (s.solver_state[0].step(), s.solver_state[0].beta);
    let mut sums = ResidualSums::default();
    let mut sum = ForceTorque::default();
    for entry in active_entries(s, i) {
        let rigid = oriented_contact(s, i, entry, |i| extrapolated_velocity_of(s, i));
        let before = &mut before[entry - begin];
        let old = rigid.sign * s.impulse[entry].0;
        let start = old + beta * (old - rigid.sign * before.0);
        let compliance = compliance_at(s, i, entry);
        let side = compliant(s, &rigid, &compliance, start);
        let next = disc_update(&side, start, step);
        let mine = side.sign * next;
        before.0 = mine;
        add_impulse(&mut sum, s, entry, mine);
        let (back, on) = (start - next, next - old);
        let error = natural_map(&side, start, natural_map_scale(s, entry, &side, &compliance));
        sums.residual_squared += side.share * error.length_squared();
        sums.restart_criterion += side.share * scaled_product(&side, back, on);
        sums.step_squared += side.share * scaled_product(&side, back, back);
        sums.curvature += side.share * compliant_work(side.n, &compliance, back);
    }
    (sum, sums)
}
