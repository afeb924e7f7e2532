//! The discrete element method, section 2.1: contact forces, leapfrog, rotation of clumps.

pub mod advance;
mod half_kick;
mod half_kick_clumps;
mod integrate_clumps;
pub mod leapfrog;
mod member_forces;
pub mod place_members;
pub mod plan;
pub mod predictor_corrector;

use crate::{contact::overlap::FORCE_FLOORS, stage::*};

/// Velocities from 0 to -1/2.
pub static HALF_KICK: Stage = Stage::new("dem", "half_kick", half_kick::half_kick, bodies);

/// Contact forces and leapfrog: a step.
pub static ADVANCE: Stage = Stage {
    check: Check { floors: FORCE_FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "advance", advance::advance, bodies)
};

/// A step of clumps 1: contact forces on members.
pub static MEMBER_FORCES: Stage = Stage {
    check: Check { floors: FORCE_FLOORS, ..Check::FORCES },
    ..Stage::new("dem", "member_forces", member_forces::member_forces, bodies)
};

/// A step of clumps 2: leapfrog and rotation.
pub static INTEGRATE_CLUMPS: Stage = Stage::new("dem", "integrate_clumps", integrate_clumps::integrate_clumps, clumps);

/// A step of clumps 3: members follow.
pub static PLACE_MEMBERS: Stage = Stage::new("dem", "place_members", place_members::place_members, bodies);

/// Velocities of clumps from 0 to -1/2.
pub static HALF_KICK_CLUMPS: Stage = Stage::new("dem", "half_kick_clumps", half_kick_clumps::half_kick_clumps, clumps);
