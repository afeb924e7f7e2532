//! Twin of `shaders/nscd/clump_response.wgsl`: clumps answer to the impulses that their members hold.

use crate::{
    body::grains::{clump, member_ids},
    nscd::{
        contact::{list_entries, store_clump_residual_sums},
        response::{
            RigidVelocity, clump_kinetic_metric, clump_velocities, extrapolated_clump, impulse_response,
            member_velocity, velocity_difference,
        },
    },
    state::{ResidualSums, Spin, State, Velocity},
};

/// After `setup_contacts`: velocities in `pass_velocity`.
pub fn clump_response_first(s: &mut State) {
    let velocities = respond_to_members(s);
    set_member_velocities(s, &velocities, |s| (&mut s.pass_velocity, &mut s.pass_spin));
}

/// After a pass: velocities in `pass_velocity_before`.
pub fn clump_response(s: &mut State) {
    let velocities = respond_to_members(s);
    set_member_velocities(s, &velocities, |s| (&mut s.pass_velocity_before, &mut s.pass_spin_before));
}

fn respond_to_members(s: &mut State) -> Vec<RigidVelocity> {
    let velocities = clump_velocities(s, impulse_response);
    store_clump_residual_sums(s, |s, c| {
        let here = clump(s, c);
        let change = velocity_difference(&extrapolated_clump(s, c, &here), &velocities[c]);
        let entries: usize =
            member_ids(s, c).map(|member_id| list_entries(s, s.index_of_id[member_id] as usize).count()).sum();
        ResidualSums {
            lipschitz_bound: entries as f64,
            curvature: clump_kinetic_metric(s, &here, &change, &change),
            ..ResidualSums::default()
        }
    });
    velocities
}

/// The velocities of a clump's surface for its members.
pub fn set_member_velocities(
    s: &mut State,
    velocities: &[RigidVelocity],
    into: impl Fn(&mut State) -> (&mut Vec<Velocity>, &mut Vec<Spin>),
) {
    for (c, velocity) in velocities.iter().enumerate() {
        let here = clump(s, c);
        for member_id in member_ids(s, c) {
            let (i, own) = (s.index_of_id[member_id] as usize, member_velocity(s, &here, velocity, member_id));
            let (into_velocity, into_spin) = into(s);
            (into_velocity[i], into_spin[i]) = (own, Spin(velocity.spin));
        }
    }
}
