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
    model::Method,
    stage::*,
    state::{Element, PARTIAL_SUMS, PartialSums, State, array},
};

/// Grains that start from rest are at rest again when half a step is taken back.
const VELOCITY_FLOORS: &[Floor] = &[(&[&array::VELOCITY_NEXT, &array::CLUMP_VELOCITY_NEXT], gravity_in_a_step)];

/// m/s
fn gravity_in_a_step(s: &State) -> f64 {
    s.params.dt * s.params.gravity.length()
}

/// Grains at rest balance.
const SUM_FLOORS: &[MemberFloors] = &[(&array::PARTIAL_SUMS, sums_at_rest)];

/// The energy, J, that gravity gives the heaviest grain in a step, what global damping takes of it, W, and in contact
/// dynamics the contact forces that balance, N.
fn sums_at_rest(s: &State) -> Vec<f64> {
    let lightest = s.velocity.iter().map(|m| m.inverse_mass).filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
    let kinetic = 0.5 * gravity_in_a_step(s).powi(2) / lightest;
    let contact_force = s.partial_sums.iter().map(|part| part.contact_force).fold(0.0, f64::max);
    let rigid = s.model.method == Method::ContactDynamics;
    let net_force = if rigid { contact_force } else { 0.0 };
    PartialSums { kinetic, net_force, dissipation: 2.0 * s.params.damping * kinetic, ..PartialSums::default() }
        .lanes(s.model.dims())
}

/// Sums over grains.
pub static MEASURE: Stage = Stage {
    check: Check { member_floors: SUM_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "measure", measure::measure, |_| PARTIAL_SUMS)
};

/// Velocities at the time of the positions.
pub static SYNCHRONISE: Stage = Stage {
    check: Check { floors: VELOCITY_FLOORS, ..Check::FORCES },
    ..Stage::new("measure", "synchronise", synchronise::synchronise, bodies)
};

/// Sums over clumps.
pub static MEASURE_CLUMPS: Stage = Stage {
    check: Check { member_floors: SUM_FLOORS, ..Check::FORCES_ON_CLUMPS },
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
