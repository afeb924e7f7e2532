//! Measurements: sums over grains, contact forces, velocities at the time of the positions; and quantities of the field from them.

mod analysis;
mod contact_forces;
pub mod contacts;
pub mod energies;
#[expect(clippy::module_inception, reason = "the kernel is called so")]
mod measure;
mod measure_clumps;
mod synchronise;
mod synchronise_clumps;

pub use analysis::*;

use crate::stage::*;
use crate::state::PARTIAL_SUMS;

/// Sums over grains.
pub static MEASURE: Stage = Stage::new("measure", "measure", measure::measure, |_| PARTIAL_SUMS);

/// Velocities at the time of the positions.
pub static SYNCHRONISE: Stage = Stage::new("measure", "synchronise", synchronise::synchronise, bodies);

/// Sums over clumps.
pub static MEASURE_CLUMPS: Stage =
    Stage::new("measure", "measure_clumps", measure_clumps::measure_clumps, |_| PARTIAL_SUMS);

/// Velocities of clumps at the time of the positions.
pub static SYNCHRONISE_CLUMPS: Stage =
    Stage::new("measure", "synchronise_clumps", synchronise_clumps::synchronise_clumps, clumps);

/// Contact forces and moments.
pub static CONTACT_FORCES: Stage = Stage::new("measure", "contact_forces", contact_forces::contact_forces, bodies);
