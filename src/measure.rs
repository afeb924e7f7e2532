//! Measurements: sums over grains, contact forces, velocities at the time of the positions; and quantities of the field
//! from them.

mod analysis;
mod contact_forces;
pub(crate) mod contacts;
pub(crate) mod energies;
#[expect(clippy::module_inception, reason = "the kernel is called so")]
mod measure;
mod measure_clumps;
pub(crate) mod plan;
pub(crate) mod sums;
mod synchronise;
mod synchronise_clumps;

pub use analysis::{
    Sample, angular_momentum, angular_momentum_of_clumps, backbone, mass_of_clump, masses, momentum,
    momentum_of_clumps, packing_fraction,
};

use crate::{
    contact::overlap::FORCE_FLOORS,
    stage::*,
    state::{PARTIAL_SUMS, State, array},
};

/// Grains that start from rest are at rest again when half a step is taken back.
const VELOCITY_FLOORS: &[Floor] = &[(&[&array::VELOCITY_NEXT, &array::CLUMP_VELOCITY_NEXT], gravity_in_a_step)];

/// m/s
fn gravity_in_a_step(s: &State) -> f64 {
    s.params.dt * s.params.gravity.length()
}

/// Sums over grains.
pub static MEASURE: Stage =
    Stage { check: Check::FORCES, ..Stage::new("measure", "measure", measure::measure, |_| PARTIAL_SUMS) };

/// Velocities at the time of the positions.
pub static SYNCHRONISE: Stage = Stage {
    check: Check { floors: VELOCITY_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "synchronise", synchronise::synchronise, bodies)
};

/// Sums over clumps.
pub static MEASURE_CLUMPS: Stage = Stage {
    check: Check::FORCES_ON_CLUMPS,
    ..Stage::new("measure", "measure_clumps", measure_clumps::measure_clumps, |_| PARTIAL_SUMS)
};

/// Velocities of clumps at the time of the positions.
pub static SYNCHRONISE_CLUMPS: Stage = Stage {
    check: Check { floors: VELOCITY_FLOORS, ..Check::FORCES_ON_CLUMPS },
    ..Stage::new("measure", "synchronise_clumps", synchronise_clumps::synchronise_clumps, clumps)
};

/// Contact forces and moments.
pub static CONTACT_FORCES: Stage = Stage {
    check: Check { floors: FORCE_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "contact_forces", contact_forces::contact_forces, bodies)
};
