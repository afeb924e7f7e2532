//! Nonsmooth contact dynamics, section 2.2: one implicit step, its contacts solved by Jacobi or coloured Gauss-Seidel
//! passes.

mod after_sweep;
mod clump_response;
pub mod coloring;
pub mod compliance;
pub mod contact;
mod extrapolate;
mod free_velocities;
mod gather_impulses;
mod gauss_seidel_pass;
pub mod gyroscopic;
mod init_solver;
mod jacobi_pass;
mod member_impulses;
mod momentum_restart;
mod move_clumps;
mod move_members;
mod move_spheres;
pub mod plan;
mod power_iteration_clumps;
mod power_iteration_eigenvalue;
mod power_iteration_pass;
mod power_iteration_start;
mod reduce_residual;
mod refresh_members;
mod relax_large;
mod residual;
pub mod response;
mod rounding;
mod scatter_impulses;
mod setup_contacts;
mod sync_members;

use crate::{stage::*, state::array};
use rounding::*;

/// Contact dynamics 1: contacts of a step.
pub static SETUP_CONTACTS: Stage =
    Stage { check: VELOCITIES, ..Stage::over_lists("nscd", "setup_contacts", setup_contacts::setup_contacts) };

/// Contact dynamics, length of the passes' steps 1: where the power iteration starts.
pub static POWER_ITERATION_START: Stage =
    Stage::new("nscd", "power_iteration_start", power_iteration_start::power_iteration_start, bodies);

/// Contact dynamics, length of the passes' steps 2: a pass of the power iteration.
pub static POWER_ITERATION_PASS: Stage = Stage {
    check: PUSHES,
    ..Stage::over_lists("nscd", "power_iteration_pass", power_iteration_pass::power_iteration_pass)
};

/// Contact dynamics, length of the passes' steps 3: the largest eigenvalue of W.
pub static POWER_ITERATION_EIGENVALUE: Stage = Stage {
    dispatch: Dispatch::OneGroup,
    ..Stage::new("nscd", "power_iteration_eigenvalue", power_iteration_eigenvalue::power_iteration_eigenvalue, |_| 1)
};

/// Contact dynamics 2: the passes of a step begin.
pub static INIT_SOLVER: Stage =
    Stage { dispatch: Dispatch::OneGroup, ..Stage::new("nscd", "init_solver", init_solver::init_solver, |_| 1) };

/// Contact dynamics 3: a pass.
pub static JACOBI_PASS: Stage =
    Stage { check: CHANGES, ..Stage::over_lists("nscd", "jacobi_pass", jacobi_pass::jacobi_pass) };

/// Contact dynamics 3, coloured: the contacts of one colour.
pub static GAUSS_SEIDEL_PASS: Stage = Stage {
    check: Check { floors: SWEPT, ..Check::ROUNDING },
    ..Stage::new("nscd", "gauss_seidel_pass", gauss_seidel_pass::gauss_seidel_pass, |sizes| sizes.bodies.div_ceil(4))
};

/// Contact dynamics 3, coloured: velocities after all colours.
pub static AFTER_SWEEP: Stage =
    Stage { check: SUMS, ..Stage::new("nscd", "after_sweep", after_sweep::after_sweep, bodies) };

/// The same where grains are large, after their contacts.
pub static RELAX_LARGE: Stage =
    Stage { check: CHANGES, ..Stage::over_lists("nscd", "relax_large", relax_large::relax_large) };

/// Contact dynamics of clumps 3, coloured: members follow the first of them.
pub static SYNC_MEMBERS: Stage =
    Stage { check: SUMS, ..Stage::new("nscd", "sync_members", sync_members::sync_members, clumps) };

/// Colors of contacts 4: impulses back into the lists.
pub static SCATTER_IMPULSES: Stage = Stage::new("nscd", "scatter_impulses", scatter_impulses::scatter_impulses, bodies);

/// Contact dynamics 5: velocities without the rounding of the passes, and the loads of grains.
pub static GATHER_IMPULSES: Stage =
    Stage { check: VELOCITIES, ..Stage::over_lists("nscd", "gather_impulses", gather_impulses::gather_impulses) };

/// Contact dynamics of clumps, after `gather_impulses`: velocities without the rounding of the passes, and loads.
pub static REFRESH_MEMBERS: Stage = Stage {
    check: Check { floors: MEMBER_FLOORS, ..Check::ROUNDING },
    ..Stage::new("nscd", "refresh_members", refresh_members::refresh_members, clumps)
};

/// Contact dynamics 4: momentum.
pub static MOMENTUM_RESTART: Stage = Stage {
    dispatch: Dispatch::OneGroup,
    ..Stage::new("nscd", "momentum_restart", momentum_restart::momentum_restart, |_| 1)
};

/// Contact dynamics 6: velocities, carried ahead by momentum.
pub static EXTRAPOLATE: Stage =
    Stage { check: VELOCITIES, ..Stage::new("nscd", "extrapolate", extrapolate::extrapolate, bodies) };

/// Contact dynamics 7: residual.
pub static RESIDUAL: Stage = Stage {
    bind: &[("extrapolated_velocity", &array::PASS_VELOCITY), ("extrapolated_spin", &array::PASS_SPIN)],
    check: SUMS,
    ..Stage::over_lists("nscd", "residual", residual::residual)
};

/// Contact dynamics 8: its norm, and whether momentum may go on.
pub static REDUCE_RESIDUAL: Stage = Stage {
    dispatch: Dispatch::OneGroup,
    ..Stage::new("nscd", "reduce_residual", reduce_residual::reduce_residual, |_| 1)
};

/// Contact dynamics 9: positions.
pub static MOVE_SPHERES: Stage =
    Stage { check: VELOCITIES, ..Stage::over_lists("nscd", "move_spheres", move_spheres::move_spheres) };

/// Contact dynamics of clumps 0: velocities if nothing touched.
pub static FREE_VELOCITIES: Stage = Stage::new("nscd", "free_velocities", free_velocities::free_velocities, clumps);

/// Contact dynamics of clumps, after `setup_contacts`: clumps answer to impulses.
pub static CLUMP_RESPONSE_FIRST: Stage = Stage {
    kernel: "clump_response",
    bind: &[("response", &array::PASS_VELOCITY), ("response_spin", &array::PASS_SPIN)],
    check: Check { floors: MEMBER_FLOORS, ..SUMS },
    ..Stage::new("nscd", "clump_response_first", clump_response::clump_response_first, clumps)
};

/// Contact dynamics of clumps, after a pass: clumps answer to impulses.
pub static CLUMP_RESPONSE: Stage = Stage {
    bind: &[("response", &array::PASS_VELOCITY_BEFORE), ("response_spin", &array::PASS_SPIN_BEFORE)],
    check: Check { floors: MEMBER_FLOORS, ..SUMS },
    ..Stage::new("nscd", "clump_response", clump_response::clump_response, clumps)
};

/// Contact dynamics of clumps, length of the passes' steps, after `power_iteration_pass`.
pub static POWER_ITERATION_CLUMPS: Stage = Stage {
    bind: &[("response", &array::PASS_VELOCITY), ("response_spin", &array::PASS_SPIN)],
    check: Check { floors: MEMBER_FLOORS, ..Check::ROUNDING },
    ..Stage::new("nscd", "power_iteration_clumps", power_iteration_clumps::power_iteration_clumps, clumps)
};

/// Contact dynamics of clumps 8: impulses that the step ends with.
pub static MEMBER_IMPULSES: Stage =
    Stage { check: VELOCITIES, ..Stage::over_lists("nscd", "member_impulses", member_impulses::member_impulses) };

/// Contact dynamics of clumps 9: centres and attitudes.
pub static MOVE_CLUMPS: Stage = Stage {
    check: Check { floors: SPIN_FLOORS, ..Check::ROUNDING },
    ..Stage::new("nscd", "move_clumps", move_clumps::move_clumps, clumps)
};

/// Contact dynamics of clumps 10: members follow.
pub static MOVE_MEMBERS: Stage = Stage::new("nscd", "move_members", move_members::move_members, bodies);
