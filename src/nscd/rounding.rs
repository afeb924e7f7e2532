//! What rounding may do to a step of contact dynamics: for `check`.

use super::contact::contact_of;
use crate::{
    contact::kicks::kicks_of_bodies,
    stage::{Check, Floor, Tolerance},
    state::{Element, ResidualSums, State, Velocity, array::*},
};

/// What impulses do one by one, where they balance.
pub const FLOORS: &[Floor] = &[
    (&[&PASS_VELOCITY, &PASS_VELOCITY_BEFORE, &EXTRAPOLATED_VELOCITY, &VELOCITY_NEXT], kick),
    (&[&PASS_SPIN, &PASS_SPIN_BEFORE, &EXTRAPOLATED_SPIN, &SPIN_NEXT], |s| kicks_of_bodies(s, contact_of)[1]),
    (&[&DISPLACEMENT], |s| s.params.dt * kick(s)),
    (&[&TANGENTIAL_FORCE_NEXT], |s| largest_impulse(s) / s.params.dt),
];

/// m/s
fn kick(s: &State) -> f64 {
    kicks_of_bodies(s, contact_of)[0]
}

/// Of velocities.
pub const VELOCITIES: Check = Check { floors: FLOORS, ..Check::ROUNDING };

/// Sums over contacts that are solved.
pub const SUMS: Check = Check {
    floors: FLOORS,
    tolerance: Tolerance::Cancellation(&RESIDUAL_SUMS),
    member_floors: &[(&RESIDUAL_SUMS, sums_of_solved_contacts)],
    ..Check::ROUNDING
};

/// The same where impulses of clumps' members change. Near the solution a change is what is left of two impulses, and its
/// rounding is theirs.
pub const CHANGES: Check = Check {
    floors: &[
        FLOORS[0],
        FLOORS[1],
        FLOORS[2],
        FLOORS[3],
        (&[&MEMBER_FORCE], largest_impulse),
        (&[&MEMBER_TORQUE], |s| {
            largest_impulse(s) * s.position.iter().map(|position| position.radius).fold(0.0, f64::max)
        }),
    ],
    ..SUMS
};

/// The same of impulses along the normal alone, whose moments about a member's centre are the rounding of their forces'.
pub const PUSHES: Check = Check {
    floors: &[
        FLOORS[0],
        FLOORS[1],
        FLOORS[2],
        FLOORS[3],
        (&[&MEMBER_TORQUE], |s| {
            let radius = s.position.iter().map(|position| position.radius).fold(0.0, f64::max);
            radius * s.member_force.iter().map(|force| force.length()).fold(0.0, f64::max)
        }),
    ],
    ..SUMS
};

/// N s
fn largest_impulse(s: &State) -> f64 {
    s.impulse.iter().map(|impulse| impulse.0.length()).fold(0.0, f64::max)
}

/// Squares of what is left where velocities cancel, (m/s)², and energies of that, J: d(x²) = 2 x dx, and dx is a rounding of
/// velocities. Friction at the Coulomb limit is beyond it by a rounding of the normal impulses.
fn sums_of_solved_contacts(s: &State) -> Vec<f64> {
    let kick = kick(s).max(contact_speed(s)).powi(2);
    let square = |m: &Velocity| m.v.length_squared().max(kick);
    let largest = |of: &dyn Fn(&Velocity) -> f64| s.extrapolated_velocity.iter().map(of).fold(0.0, f64::max);
    let energy = |m: &Velocity| if m.inverse_mass == 0.0 { 0.0 } else { square(m) / m.inverse_mass };
    let (all_squares, all_energies) = (largest(&square), largest(&energy));
    let left = |all: f64, of: &dyn Fn(&ResidualSums) -> f64| {
        let left = s.residual_sums.iter().map(|sums| of(sums).abs()).fold(0.0, f64::max);
        let part = Tolerance::ROUNDINGS / Tolerance::CANCELLED_ROUNDINGS;
        (all * s.model.precision.epsilon()).max(2.0 * part * (left * all).sqrt())
    };
    // Over the least that acts on a contact.
    let speeds = s.contact_geometry.iter().map(|geometry| geometry.speed).filter(|speed| *speed > 0.0);
    let relative = contact_speed(s).max(self::kick(s)) / speeds.fold(f64::INFINITY, f64::min);
    let sums = ResidualSums {
        residual_squared: left(all_squares, &|sums| sums.residual_squared),
        restart_criterion: left(all_energies, &|sums| sums.restart_criterion),
        curvature: left(all_energies, &|sums| sums.curvature),
        step_squared: left(all_energies, &|sums| sums.step_squared),
        largest_residual: relative,
        resolved_residual: relative,
        coulomb_excess: s.residual_sums.iter().map(|sums| sums.max_normal_impulse).fold(0.0, f64::max),
        ..ResidualSums::default()
    };
    sums.lanes(s.model.dims())
}

/// Spins of clumps are sums of what single members give them, and these may nearly cancel.
pub const SPIN_FLOORS: &[Floor] =
    &[(&[&PASS_SPIN, &PASS_SPIN_BEFORE, &EXTRAPOLATED_SPIN, &CLUMP_SPIN_NEXT], largest_spin_from_a_member)];

/// What members get from their clump.
pub const MEMBER_FLOORS: &[Floor] = &[FLOORS[0], SPIN_FLOORS[0]];

/// rad/s
fn largest_spin_from_a_member(s: &State) -> f64 {
    let of_member = |member_id: usize| {
        let (i, c) = (s.index_of_id[member_id] as usize, s.clump_of_id[member_id] as usize);
        s.inverse_moments[c].0.max_element()
            * (s.member_offset[member_id].0.length() * s.member_force[i].length() + s.member_torque[i].0.length())
    };
    (0..s.sizes.bodies).map(of_member).fold(0.0, f64::max)
}

/// What a sweep updates in place: impulses answer to all of a contact's velocity, not to what is left of it.
pub const SWEPT: &[Floor] = &[
    (&[&PASS_RESIDUAL], cancelled_velocities),
    (&[&EXTRAPOLATED_VELOCITY], contact_speed),
    (&[&EXTRAPOLATED_SPIN], |s| {
        contact_speed(s) / s.position.iter().map(|position| position.radius).fold(f64::INFINITY, f64::min)
    }),
];

/// Of the sides of a contact past each other, m/s.
fn contact_speed(s: &State) -> f64 {
    let pushed = s.extrapolated_velocity.iter().map(|m| m.v.length());
    pushed.chain(s.free_contact_velocity.iter().map(|q| q.0.length())).fold(0.0, f64::max)
}

/// Squares of what is left where velocities cancel, (m/s)²: d(x²) = 2 x dx, and dx is a rounding of velocities.
fn cancelled_velocities(s: &State) -> f64 {
    let v = contact_speed(s);
    let left = s.pass_residual.iter().copied().fold(0.0, f64::max).sqrt();
    2.0 * v * left.max(64.0 * s.model.precision.epsilon() * v)
}
