//! Twin of `shaders/nscd/sync_members.wgsl`: members get the velocities that the sweeps have given the first of them,
//! and what the momentum of the next pass depends on.

use crate::{
    body::{
        grains::{arm_of, clump, member_ids},
        rotation::surface_velocity,
    },
    nscd::{
        contact::store_clump_residual_sums,
        response::{
            RigidVelocity, clump_kinetic_metric, extrapolated_clump, from_first_member, impulse_response,
            velocity_difference,
        },
    },
    state::{ResidualSums, State, Velocity},
};

pub fn sync_members(s: &mut State) {
    store_clump_residual_sums(s, sync_members_of);
    for c in 0..s.sizes.clumps {
        let (q, first) = (clump(s, c).orientation, s.first_member[c] as usize);
        let i = s.index_of_id[first] as usize;
        let member_arm = arm_of(s, q, first);
        let (mut velocity, mut spin) = (s.extrapolated_velocity[i], s.extrapolated_spin[i]);
        if let Some(added) = of_large_contacts(s, c) {
            velocity.v += added.v + surface_velocity(added.spin, member_arm);
            spin.0 += added.spin;
        }
        for member_id in member_ids(s, c) {
            let from_first = arm_of(s, q, member_id) - member_arm;
            let member = s.index_of_id[member_id] as usize;
            s.pass_velocity_before[member] =
                Velocity { v: velocity.v + surface_velocity(spin.0, from_first), ..velocity };
            s.pass_spin_before[member] = spin;
        }
    }
}

/// What contacts without a colour have left with the members.
fn of_large_contacts(s: &State, c: usize) -> Option<RigidVelocity> {
    (s.sizes.large > 0).then(|| impulse_response(s, c, &clump(s, c)))
}

fn sync_members_of(s: &State, c: usize) -> ResidualSums {
    let here = clump(s, c);
    let i = s.index_of_id[s.first_member[c] as usize] as usize;
    let mut now = extrapolated_clump(s, c, &here);
    if let Some(added) = of_large_contacts(s, c) {
        now = RigidVelocity { v: now.v + added.v, spin: now.spin + added.spin };
    }
    let last = from_first_member(s, c, &here, s.pass_velocity[i].v, s.pass_spin[i].0);
    let before = from_first_member(s, c, &here, s.pass_velocity_before[i].v, s.pass_spin_before[i].0);
    // From where the sweeps set out to where they led, along the change from the pass before.
    let beta = s.solver_state[0].beta;
    let change = velocity_difference(&before, &last);
    let start = RigidVelocity { v: last.v + beta * change.v, spin: last.spin + beta * change.spin };
    let restart_criterion =
        clump_kinetic_metric(s, &here, &velocity_difference(&now, &start), &velocity_difference(&last, &now));
    ResidualSums { restart_criterion, ..ResidualSums::default() }
}
