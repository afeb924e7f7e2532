//! Arrays that are compared by a rule of their own, whatever stage writes them.

use crate::{
    body::{
        bodies::body,
        grains::{clump, member_ids},
        rotation::inverse_inertia,
    },
    contact::contacts::closed_contacts,
    measure::contacts::contact_of,
    space::precision::{low_of, spin_low_of},
    state::{Array, Counters, State, VelocityLow, array::*},
    units::Quantity,
};
use glam::DVec3;

/// How an array is compared, if not number by number.
pub enum Rule {
    /// A value and all that single precision leaves out of it together, over a scale in their unit. In double precision the
    /// value stands alone, and is compared as any.
    Parts { value: &'static Array, low: &'static [&'static Array], scale: fn(&State) -> f64 },
    /// Velocity and spin of a row with what single precision leaves out of them, over scales in their units.
    Velocities { of: fn(&State, usize) -> [DVec3; 2], scales: fn(&State) -> [f64; 2] },
    /// Twin and device, in numbers that are relative already.
    Records(fn(&State, &State) -> f64),
}

/// The rules, with the arrays that they are for.
static RULES: &[(&[&Array], Rule)] = &[
    (
        &[&POSITION_LOW_NEXT, &POSITION_NEXT],
        Rule::Parts { value: &POSITION_NEXT, low: &[&POSITION_LOW_NEXT], scale: displacement_of_a_body },
    ),
    (
        &[&CENTER_LOW_NEXT, &CENTER_NEXT],
        Rule::Parts { value: &CENTER_NEXT, low: &[&CENTER_LOW_NEXT], scale: displacement_of_a_clump },
    ),
    (
        &[&ORIENTATION_REST_NEXT, &ORIENTATION_LOW_NEXT, &ORIENTATION_NEXT],
        Rule::Parts {
            value: &ORIENTATION_NEXT,
            low: &[&ORIENTATION_LOW_NEXT, &ORIENTATION_REST_NEXT],
            scale: rotation_of_a_clump,
        },
    ),
    (&[&VELOCITY_LOW_NEXT], Rule::Velocities { of: velocities_of_a_body, scales: kicks_of_bodies }),
    (&[&CLUMP_VELOCITY_LOW_NEXT], Rule::Velocities { of: velocities_of_a_clump, scales: kicks_of_clumps }),
    (&[&COUNTERS], Rule::Records(counters)),
    (&[&ROTATION_ITERATIONS], Rule::Records(rotation_iterations)),
];

/// The rule of an array, if it has one.
pub fn rule(array: &Array) -> Option<&'static Rule> {
    RULES.iter().find(|(arrays, _)| arrays.contains(&array)).map(|(_, rule)| rule)
}

/// The largest of this step, m, which is what must not be lost.
fn displacement_of_a_body(s: &State) -> f64 {
    let displacement = s.velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * s.params.dt;
    // Members of clumps are put at the ends of arms, anew in every step, with 34 bits of the longest of these.
    let arm = s.member_offset.iter().map(|arm| arm.0.length()).fold(0.0, f64::max);
    displacement.max(arm * 2f64.powi(-15)).max(s.params.quantum / 64.0)
}

/// The same for centres of clumps.
fn displacement_of_a_clump(s: &State) -> f64 {
    let fastest = s.clump_velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max);
    (fastest * s.params.dt).max(s.params.quantum / 64.0)
}

/// The same for quaternions.
fn rotation_of_a_clump(s: &State) -> f64 {
    let fastest = s.clump_spin_next.iter().map(|w| w.0.abs().max_element()).fold(0.0, f64::max);
    // At rest, some units in the last place of the low parts are what their lengths are corrected by.
    (0.5 * fastest * s.params.dt).max(2f64.powi(-16))
}

/// What is compared of `velocity_low_next`.
fn velocities_of_a_body(s: &State, i: usize) -> [DVec3; 2] {
    with_low(s, s.velocity_next[i].v, s.spin_next.get(i).map_or(DVec3::ZERO, |spin| spin.0), s.velocity_low_next[i])
}

/// And of `clump_velocity_low_next`.
fn velocities_of_a_clump(s: &State, c: usize) -> [DVec3; 2] {
    with_low(s, s.clump_velocity_next[c].v, s.clump_spin_next[c].0, s.clump_velocity_low_next[c])
}

fn with_low(s: &State, v: DVec3, w: DVec3, low: VelocityLow) -> [DVec3; 2] {
    [v + low_of(s, Quantity::Velocity, v, low.v), w + spin_low_of(s, w, low.spin)]
}

/// The largest that any of the forces on a body does to its velocity and its spin in a step: what must not be lost, and
/// what sums of forces of either sign are rounded by.
fn kicks_of_bodies(s: &State) -> [f64; 2] {
    let of_body = |i: usize| {
        let here = body(s, i);
        let forces = closed_contacts(s, i, &here, contact_of).map(|(_, contact)| contact.force.length());
        let (force, inverse_mass) = (forces.sum::<f64>(), here.velocity.inverse_mass);
        let inertia = inverse_inertia(s, &here.position, inverse_mass);
        kick(s, [inverse_mass * force, inertia * here.position.radius * force], [here.velocity.v, here.spin])
    };
    (0..s.sizes.bodies).map(of_body).fold([0.0; 2], larger)
}

/// The same of clumps.
fn kicks_of_clumps(s: &State) -> [f64; 2] {
    let of_clump = |c: usize| {
        let here = clump(s, c);
        let (mut force, mut torque) = (0.0, 0.0);
        for member_id in member_ids(s, c) {
            let i = s.index_of_id[member_id] as usize;
            let arm = s.member_offset[member_id].0.length() + s.position[i].radius;
            for (_, contact) in closed_contacts(s, i, &body(s, i), contact_of) {
                force += contact.force.length();
                torque += arm * contact.force.length();
            }
        }
        let inertia = here.inverse_moments.max_element();
        // Products of angular velocities too.
        let gyration = here.inverse_moments.max_element() / here.inverse_moments.min_element();
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

/// Flags must agree; the displacement is a number behind its bits.
fn counters(twin: &State, device: &State) -> f64 {
    let (twin, device) = (twin.counters[0], device.counters[0]);
    let Counters { max_displacement, max_coordinate, .. } = twin;
    if twin != (Counters { max_displacement, max_coordinate, ..device }) {
        return 1.0;
    }
    let difference = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|bits| f64::from(f32::from_bits(bits)));
        if a == b { 0.0 } else { (a - b).abs() / a.max(b) }
    };
    difference(max_displacement, device.max_displacement).max(difference(max_coordinate, device.max_coordinate))
}

/// Rounding may make a round more or less.
fn rotation_iterations(twin: &State, device: &State) -> f64 {
    let (a, b) = (twin.rotation_iterations[0], device.rotation_iterations[0]);
    f64::from(u8::from(a.most.abs_diff(b.most) > 1 || a.capped != b.capped))
}
