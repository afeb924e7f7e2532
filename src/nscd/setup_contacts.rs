//! Twin of `shaders/nscd/setup_contacts.wgsl`: the contacts of a step, and the velocities that the impulses of the last
//! step would give it.

use crate::{
    body::{ForceTorque, bodies::body, rotation::spin_of},
    contact::history::set_active,
    model::Grains,
    nscd::{
        contact::{
            active_entries, bias_velocity_of, combined, impulse_sum, list_entries, residual_scale_of, separation_with,
            store_residual_sums, warm_start_impulse,
        },
        response::{free_velocity_of, inverse_effective_mass_of, response, store_member_load},
    },
    space::walls::wall_velocity,
    state::{ACTIVE, ContactGeometry, INDEX, ResidualSums, State},
};
use rayon::prelude::*;

pub fn setup_contacts(s: &mut State) {
    let mut bad = 0;
    let slack = s.params.dt * s.params.gravity.length();
    for i in 0..s.sizes.bodies {
        let here = body(s, i);
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            let (tagged, old) = (s.neighbour[entry], warm_start_impulse(s, entry));
            let j = (tagged & INDEX) as usize;
            let touch = separation_with(s, i, &here, j);
            let bias_velocity = bias_velocity_of(s, touch.gap);
            let velocity_to = match j.checked_sub(s.sizes.bodies) {
                None => free_velocity_of(s, j).v,
                Some(w) => wall_velocity(&s.wall[w], here.position.x),
            };
            // Pairs that are not about to touch take no part in passes, unless the residual finds that they should.
            let approach = (free_velocity_of(s, i).v - velocity_to).dot(touch.n);
            set_active(&mut s.neighbour[entry], tagged & ACTIVE != 0 || bias_velocity <= approach + slack);
            s.contact_geometry[entry] = ContactGeometry { n: touch.n, bias_velocity };
            let (inverse_effective_mass, delassus_eigenvalue) = inverse_effective_mass_of(s, i, j, touch.gap, touch.n);
            s.inverse_effective_mass[entry] = inverse_effective_mass;
            if let Some(kept) = s.delassus_eigenvalue.get_mut(entry) {
                *kept = delassus_eigenvalue;
            }
            s.impulse[entry].0 = old;
            s.impulse_before[entry].0 = old;
            if j >= s.sizes.bodies && touch.gap < -here.position.radius {
                bad = bad.max(s.params.bodies - s.id[i]);
            }
        }
    }
    store_residual_sums(s, |s, i| combined(imposed_speed(s, i), residual_scale(s, i)));
    s.counters[0].lost_body = s.counters[0].lost_body.max(bad);
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

/// The largest velocity that a wall, a fixed grain, a spin or an overlap asks for.
fn imposed_speed(s: &State, i: usize) -> ResidualSums {
    let mut sums = ResidualSums::default();
    let rim_speed = s.position[i].radius * spin_of(s, i).length();
    for entry in active_entries(s, i) {
        let j = (s.neighbour[entry] & INDEX) as usize;
        let speed = match j.checked_sub(s.sizes.bodies) {
            Some(w) => wall_velocity(&s.wall[w], s.position[i].x).length(),
            None if s.velocity[j].inverse_mass == 0.0 => free_velocity_of(s, j).v.length(),
            None => 0.0,
        };
        sums.imposed_speed = sums.imposed_speed.max(speed.max(rim_speed).max(-s.contact_geometry[entry].bias_velocity));
    }
    sums
}

/// What a sphere adds; for members, clumps do.
fn residual_scale(s: &State, i: usize) -> ResidualSums {
    if s.model.grains == Grains::Clumps {
        return ResidualSums::default();
    }
    let free = free_velocity_of(s, i);
    residual_scale_of(s, list_entries(s, i).count(), free.v.length_squared(), free.inverse_mass)
}
