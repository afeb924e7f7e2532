//! What forces do to velocities in a step, one by one: where they balance, sums of them are rounded by that, for `check`.

use super::contacts::{ContactOf, closed_contacts};
use crate::{
    body::{
        bodies::body,
        grains::{clump, member_ids},
        rotation::inverse_inertia,
    },
    state::State,
};
use glam::DVec3;

/// The largest that the forces on a body, each by itself, do to its velocity, m/s, and its spin, rad/s, in a step.
pub fn kicks_of_bodies(s: &State, of: ContactOf) -> [f64; 2] {
    let of_body = |i: usize| {
        let here = body(s, i);
        let force: f64 = closed_contacts(s, i, &here, of).map(|(_, contact)| contact.force.length()).sum();
        let inverse_mass = here.velocity.inverse_mass;
        let inertia = inverse_inertia(s, &here.position, inverse_mass);
        kick(s, [inverse_mass * force, inertia * here.position.radius * force], [here.velocity.v, here.spin])
    };
    (0..s.sizes.bodies).map(of_body).fold([0.0; 2], larger)
}

/// The same of clumps.
pub fn kicks_of_clumps(s: &State, of: ContactOf) -> [f64; 2] {
    let of_clump = |c: usize| {
        let here = clump(s, c);
        let (mut force, mut torque) = (0.0, 0.0);
        for member_id in member_ids(s, c) {
            let i = s.index_of_id[member_id] as usize;
            let arm = s.member_offset[member_id].0.length() + s.position[i].radius;
            for (_, contact) in closed_contacts(s, i, &body(s, i), of) {
                force += contact.force.length();
                torque += arm * contact.force.length();
            }
        }
        let inertia = here.inverse_moments.max_element();
        // Products of angular velocities too.
        let gyration = inertia / here.inverse_moments.min_element();
        let spinning = if gyration.is_finite() { gyration * here.spin.length_squared() } else { 0.0 };
        kick(s, [here.velocity.inverse_mass * force, inertia * torque + spinning], [here.velocity.v, here.spin])
    };
    (0..s.sizes.clumps).map(of_clump).fold([0.0; 2], larger)
}

/// By accelerations of contacts, gravity and damping.
fn kick(s: &State, accelerations: [f64; 2], velocities: [DVec3; 2]) -> [f64; 2] {
    let p = &s.params;
    let [v, w] = velocities.map(|v| p.damping * v.length());
    [p.dt * (accelerations[0] + p.gravity.length() + v), p.dt * (accelerations[1] + w)]
}

fn larger(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].max(b[0]), a[1].max(b[1])]
}
