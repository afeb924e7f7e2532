//! Twin of `shaders/nscd/setup_contacts.wgsl`: the contacts of a step, and the velocities that the impulses of the last
//! step would give it.

use crate::{
    body::{ForceTorque, bodies::body},
    contact::{geometry::is_deep, history::set_active, materials::pair_of},
    model::Grains,
    nscd::{
        compliance::{bias_velocity_of, compliance_of, spring_velocity},
        contact::{
            FreeMotion, active_entries, impulse_sum, list_entries, past, separation_with, store_residual_sums,
            warm_start_impulse,
        },
        response::{free_motion, inverse_effective_mass_of, response, store_member_load},
    },
    space::{boundary::past_flow, turning::wall_velocity, walls::is_crossed},
    state::{ACTIVE, ContactGeometry, INDEX, Packed, ResidualSums, State},
};
use rayon::prelude::*;

pub fn setup_contacts(s: &mut State) {
    let (mut bad, mut deep) = (0, false);
    let slack = s.params.dt * s.params.gravity.length();
    for i in 0..s.sizes.bodies {
        let (here, free) = (body(s, i), free_motion(s, i));
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            let (tagged, old) = (s.neighbour[entry], warm_start_impulse(s, entry));
            let j = (tagged & INDEX) as usize;
            let touch = separation_with(s, i, &here, j);
            let (radius, other) = (here.position.radius, s.position.get(j).map_or(f64::INFINITY, |there| there.radius));
            deep |= is_deep(s, touch.gap, radius.min(other));
            let (inverse_effective_mass, delassus_eigenvalue) = inverse_effective_mass_of(s, i, j, touch.gap, touch.n);
            let pair = pair_of(s, i, j);
            let bias_velocity = bias_velocity_of(s, touch.gap, &pair, &inverse_effective_mass);
            let [arm, arm_to] = [inverse_effective_mass.arm * touch.n, -inverse_effective_mass.arm_to * touch.n];
            let there = match j.checked_sub(s.sizes.bodies) {
                None => free_motion(s, j),
                Some(w) => {
                    FreeMotion { v: wall_velocity(s, &s.wall[w], here.position.x + arm), ..FreeMotion::default() }
                }
            };
            let v = past(&free, arm, &there, arm_to);
            let v = if j < s.sizes.bodies { past_flow(s, s.model.boundary, v, arm - arm_to) } else { v };
            let compliance = compliance_of(s, &pair, &inverse_effective_mass);
            let q = (v - bias_velocity * touch.n) + spring_velocity(s, entry, touch.n, &compliance);
            s.free_contact_velocity[entry] = Packed(q);
            let speed = v.length().max(-bias_velocity).max(slack);
            s.contact_geometry[entry] = ContactGeometry { n: touch.n, speed };
            // Pairs that are not about to touch take no part in passes, unless the residual finds that they should.
            set_active(&mut s.neighbour[entry], tagged & ACTIVE != 0 || q.dot(touch.n) + slack >= 0.0);
            s.inverse_effective_mass[entry] = inverse_effective_mass;
            if let Some(kept) = s.delassus_eigenvalue.get_mut(entry) {
                *kept = delassus_eigenvalue;
            }
            s.impulse[entry].0 = old;
            s.impulse_before[entry].0 = old;
            if j >= s.sizes.bodies && is_crossed(s, touch.gap, here.position.radius) {
                bad = bad.max(s.params.bodies - s.id[i]);
            }
        }
    }
    store_residual_sums(s, residual_scale);
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
    s.counters[0].deep_overlaps = s.counters[0].deep_overlaps.max(u32::from(deep));
    let sums: Vec<ForceTorque> =
        (0..s.sizes.bodies).into_par_iter().map(|i| impulse_sum(s, list_entries(s, i))).collect();
    if s.model.grains == Grains::Clumps {
        return store_member_load(s, sums.into_iter());
    }
    for (i, sum) in sums.into_iter().enumerate() {
        let (velocity, spin) = response(s, i, &sum);
        (s.pass_velocity[i], s.pass_velocity_before[i], s.extrapolated_velocity[i]) = (velocity, velocity, velocity);
        for spins in [&mut s.pass_spin, &mut s.pass_spin_before, &mut s.extrapolated_spin] {
            if let Some(kept) = spins.get_mut(i) {
                kept.0 = spin;
            }
        }
    }
}

/// What residuals are relative to, and of spheres a bound on the eigenvalues of W; that of members their clump knows.
fn residual_scale(s: &State, i: usize) -> ResidualSums {
    let mut sums = ResidualSums::default();
    if s.model.grains == Grains::Spheres {
        sums.lipschitz_bound = list_entries(s, i).count() as f64;
    }
    for entry in active_entries(s, i) {
        let with_wall = (s.neighbour[entry] & INDEX) as usize >= s.sizes.bodies;
        sums.reference += if with_wall { 1.0 } else { 0.5 } * s.contact_geometry[entry].speed.powi(2);
    }
    sums
}
