//! Twin of `shaders/nscd/relax_large.wgsl`: what `after_sweep` does, when the contacts of large grains, which have no
//! colours, have taken a step, all at once.

use crate::{
    body::{ForceTorque, rotation::surface_velocity},
    model::Grains,
    neighbours::lists::is_large,
    nscd::{
        after_sweep::restart_criterion,
        contact::{active_entries, add_impulse, oriented_contact, store_residual_sums},
        response::{
            contact_body, extrapolated_velocity_of, largest_response, natural_map_scale, response, standing_for,
            store_member_load,
        },
    },
    solve::natural_map::{UpdateScales, disc_update, natural_map},
    state::{INDEX, Packed, ResidualSums, Spin, State, Velocity},
};
use glam::DVec3;
use rayon::prelude::*;

/// Whether one of the two of a contact is large.
pub fn joins_large(s: &State, i: usize, entry: usize) -> bool {
    is_large(&s.sizes, i) || is_large(&s.sizes, (s.neighbour[entry] & INDEX) as usize)
}

pub fn relax_large(s: &mut State) {
    let updates: Vec<Vec<Update>> = (0..s.sizes.bodies).into_par_iter().map(|i| updates_of(s, i)).collect();
    let mut sums = Vec::new();
    let mut changes = Vec::new();
    for (i, updates) in updates.iter().enumerate() {
        let mut change = ForceTorque::default();
        let mut residual_squared = 0.0;
        for update in updates {
            s.impulse_before[update.entry] = Packed(update.next);
            add_impulse(&mut change, s, update.entry, update.change);
            residual_squared += update.residual_squared;
        }
        changes.push(change);
        sums.push(ResidualSums { residual_squared: residual_squared + s.pass_residual[i], ..ResidualSums::default() });
    }
    s.pass_residual.fill(0.0);
    if s.model.grains == Grains::Clumps {
        store_residual_sums(s, |_, i| sums[i]);
        return store_member_load(s, changes.into_iter());
    }
    let swept = |s: &State, i: usize| {
        let ((v, w), (velocity, spin)) = (extrapolated_velocity_of(s, i), response(s, i, &changes[i]));
        (Velocity { v: v + velocity.v, ..s.extrapolated_velocity[i] }, w + spin)
    };
    store_residual_sums(s, |s, i| {
        let (velocity, spin) = swept(s, i);
        ResidualSums { restart_criterion: restart_criterion(s, i, &velocity, spin), ..sums[i] }
    });
    for i in 0..s.sizes.bodies {
        let (velocity, spin) = swept(s, i);
        s.pass_velocity_before[i] = velocity;
        if let Some(kept) = s.pass_spin_before.get_mut(i) {
            *kept = Spin(spin);
        }
    }
}

/// What becomes of the contact at an entry.
struct Update {
    entry: usize,
    /// N s, on the grain of interest, and what it is more than before.
    next: DVec3,
    change: DVec3,
    /// (m/s)², of the natural map that the update has met.
    residual_squared: f64,
}

/// Of the contacts of body i without a colour.
fn updates_of(s: &State, i: usize) -> Vec<Update> {
    let update = |entry: usize| {
        let j = (s.neighbour[entry] & INDEX) as usize;
        let side = oriented_contact(s, i, entry, |i| swept(s, i));
        let old = side.sign * s.impulse[entry].0;
        let start = old + s.solver_state[0].beta * (old - side.sign * s.impulse_before[entry].0);
        let error = natural_map(&side, start, natural_map_scale(s, entry, side.tangential));
        let (mut split, scales) = (side, [Some(i), Some(j).filter(|&j| j < s.sizes.bodies)]);
        for UpdateScales { normal, tangential } in scales.into_iter().flatten().map(|i| split_scales(s, i)) {
            split.normal += normal;
            split.tangential += tangential;
        }
        let next = disc_update(&split, start, 1.0);
        Update {
            entry,
            next: side.sign * next,
            change: side.sign * (next - start),
            residual_squared: side.share * error.length_squared(),
        }
    };
    active_entries(s, i).filter(|&entry| joins_large(s, i, entry)).map(update).collect()
}

/// What the other contacts of its grain, which body i is a part of, add to the scales of one.
fn split_scales(s: &State, i: usize) -> UpdateScales {
    let others = f64::from(s.large_contacts[standing_for(s, i)] - 1);
    let UpdateScales { normal, tangential } = largest_response(s, i);
    UpdateScales { normal: others * normal, tangential: others * tangential }
}

/// How body i moves since the colours have been relaxed.
fn swept(s: &State, i: usize) -> (DVec3, DVec3) {
    let body = contact_body(s, i, DVec3::ZERO);
    (body.velocity.v + surface_velocity(body.spin, body.arm), body.spin)
}
