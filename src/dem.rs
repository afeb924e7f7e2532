//! The discrete element method, section 2.1: contact forces, leapfrog, rotation of clumps.

pub mod advance;
mod advance_large;
pub mod blocks;
mod damp;
mod grow;
mod half_kick;
mod half_kick_clumps;
mod integrate_clumps;
pub mod leapfrog;
mod measure_gain;
pub mod member_forces;
pub mod place_members;
pub mod plan;
pub mod predictor_corrector;
mod restart;

use crate::{
    contact::{
        kicks::{kicks_of_bodies, kicks_of_clumps},
        law::contact_of,
        overlap::{largest_force, largest_torque},
    },
    stage::*,
    state::{Sizes, State, array::*},
};

/// What contacts do one by one, where they balance.
const FLOORS: &[Floor] = &[
    (&[&TANGENTIAL_FORCE, &MEMBER_FORCE], largest_force),
    (&[&MEMBER_TORQUE, &ROLLING_TORQUE], largest_torque),
    (&[&VELOCITY_NEXT], |s| kicks_of_bodies(s, contact_of)[0]),
    (&[&SPIN_NEXT], |s| kicks_of_bodies(s, contact_of)[1]),
    (&[&DISPLACEMENT], |s| s.params.dt * kicks_of_bodies(s, contact_of)[0]),
    (&[&CLUMP_VELOCITY_NEXT], |s| kicks_of_clumps(s, contact_of)[0]),
    (&[&CLUMP_SPIN_NEXT, &SPIN_INCREMENT], |s| kicks_of_clumps(s, contact_of)[1]),
];

/// Velocities from 0 to -1/2.
pub static HALF_KICK: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "half_kick", half_kick::half_kick, bodies)
};

/// Contact forces and leapfrog: a step.
pub static ADVANCE: Stage = Stage {
    dispatch: Dispatch::GroupEach(|sizes| sizes.bodies.div_ceil(ADVANCE_LANES)),
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "advance", advance::advance, bodies)
};

/// `LANES` of `advance.wgsl`.
const ADVANCE_LANES: usize = 256;

/// The same of large grains.
pub static ADVANCE_LARGE: Stage = Stage {
    dispatch: Dispatch::GroupEach(large),
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "advance_large", advance_large::advance_large, large)
};

/// A step of clumps 1: contact forces on members.
pub static MEMBER_FORCES: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "member_forces", member_forces::member_forces, bodies)
};

/// A step of clumps 2: leapfrog and rotation.
pub static INTEGRATE_CLUMPS: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::ROUNDING },
    ..Stage::new("dem", "integrate_clumps", integrate_clumps::integrate_clumps, clumps)
};

/// A step of clumps 3: members follow.
pub static PLACE_MEMBERS: Stage = Stage::new("dem", "place_members", place_members::place_members, bodies);

/// Velocities of clumps from 0 to -1/2.
pub static HALF_KICK_CLUMPS: Stage = Stage {
    check: Check { floors: FLOORS, ..Check::FORCES_ON_CLUMPS },
    ..Stage::new("dem", "half_kick_clumps", half_kick_clumps::half_kick_clumps, clumps)
};

/// Adaptive damping 1: what all forces of a step do.
pub static MEASURE_GAIN: Stage = Stage {
    check: Check { floors: &[(&[&ENERGY_GAIN], measure_gain::largest_gain)], ..Check::ROUNDING },
    ..Stage::new("dem", "measure_gain", measure_gain::measure_gain, Sizes::partial_sums)
};

/// Adaptive damping 2: whether momentum is dropped.
pub static RESTART: Stage =
    Stage { dispatch: Dispatch::OneGroup, ..Stage::new("dem", "restart", restart::restart, |_| 1) };

/// Radii and masses.
pub static GROW: Stage = Stage {
    check: Check { floors: &[(&[&DISPLACEMENT], largest_radius)], ..Check::ROUNDING },
    ..Stage::new("dem", "grow", grow::grow, |sizes| sizes.bodies.max(sizes.materials))
};

/// What grains have grown by is the difference of two radii, m.
fn largest_radius(s: &State) -> f64 {
    s.position.iter().map(|here| here.radius).fold(0.0, f64::max)
}

/// Adaptive damping 3: what is left of the velocities.
pub static DAMP: Stage = Stage::new("dem", "damp", damp::damp, bodies);
