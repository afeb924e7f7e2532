//! A step of nonsmooth contact dynamics, section 2.2, with positions and velocities at n before it.

use super::{coloring::*, *};
use crate::{
    body::plan::exchange,
    model::{Boundary, Compliance, Grains, Model},
    neighbours::{
        DISPLACEMENT_CHECK,
        plan::{forget, lists},
    },
    plan::*,
    solve::momentum::POWER_ITERATIONS,
    space::{self, DEFORM_CELL},
    state::array::*,
};

/// Rounds of colouring before the host asks whether all contacts have a colour.
const COLORING_ROUNDS: u32 = 8;

/// The impulses of the contacts, then the motion. Lists have to reach to where the step ends, because grains meet on
/// their way there.
pub fn step(model: &Model) -> Plan {
    let motion = motion(model);
    let step = plan([
        repeat(Loop::IfListsAreUsedUp, lists(model)),
        repeat(Loop::IfListsAreNew, if model.colored { reset_colors() } else { largest_eigenvalue(model) })
            .when(!model.solved_on_host),
        setup(model),
        repeat(Loop::UntilSolved, plan([impulses(model), residual(model)])),
        motion.clone(),
        run(&DISPLACEMENT_CHECK),
        repeat(Loop::IfStepIsTakenBack, swap_again(&motion.swaps())),
    ]);
    repeat(Loop::UntilStepIsWithinLists, step)
}

/// Those of the contacts that there are so far.
fn impulses(model: &Model) -> Plan {
    if model.solved_on_host {
        return solve_on_host();
    }
    plan([repeat(Loop::IfContactsAreNew, color(model)).when(model.colored), repeat(Loop::Passes, pass(model))])
}

/// The contacts of a step, with the impulses of the last one.
fn setup(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    // Without colours clumps have no pass before the first, so nothing of it may be left that could spoil it;
    // `order_by_color` sees to that.
    let extrapolated = plan([clear([&PASS_VELOCITY_BEFORE, &PASS_SPIN_BEFORE]), run(&EXTRAPOLATE)]);
    plan([
        forget(),
        run(&FREE_VELOCITIES).when(clumps),
        run(&SETUP_CONTACTS),
        run(&CLUMP_RESPONSE_FIRST).when(clumps),
        run(&INIT_SOLVER),
        extrapolated.when(clumps && !model.colored),
    ])
}

/// Power iteration for the largest eigenvalue of W, which bounds the steps of Jacobi's passes.
fn largest_eigenvalue(model: &Model) -> Plan {
    let iteration = plan([
        run(&POWER_ITERATION_PASS),
        run(&POWER_ITERATION_CLUMPS).when(model.grains == Grains::Clumps),
        run(&POWER_ITERATION_EIGENVALUE),
        run(&EXTRAPOLATE),
    ]);
    plan([setup(model), run(&POWER_ITERATION_START), repeat(Loop::Times(POWER_ITERATIONS), iteration)])
}

/// All contacts without a colour.
fn reset_colors() -> Plan {
    clear([&CONTACT_COLOR, &COLOR_COUNT, &COLORING_STATE, &COLOR_CURSOR])
}

/// Colours for all contacts that have none, then contacts in the order of their colours.
fn color(model: &Model) -> Plan {
    let round = plan([run(&PROPOSE), run(&RESOLVE).when(model.grains == Grains::Clumps), run(&ASSIGN_COLORS)]);
    // The last proposal counts the contacts that are still without.
    let rounds = plan([
        repeat(Loop::IfColorsDoNotFit, reset_colors()),
        repeat(Loop::Times(COLORING_ROUNDS), round),
        run(&PROPOSE),
    ]);
    let large = plan([clear([&LARGE_CONTACTS]), run(&COUNT_LARGE_CONTACTS)]);
    plan([repeat(Loop::UntilColored, rounds), large.when(model.large_grains), run(&ORDER_BY_COLOR)])
}

/// A pass over all contacts, at once or colour by colour; then momentum.
fn pass(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    let sweep = plan([run(&GAUSS_SEIDEL_PASS), swap(model, [(&COLOR_CURSOR, &COLOR_CURSOR_NEXT)])]);
    let after_colors = if model.large_grains { &RELAX_LARGE } else { &AFTER_SWEEP };
    plan([
        plan([repeat(Loop::ForEachColor, sweep), run(after_colors), run(&SYNC_MEMBERS).when(clumps)])
            .when(model.colored),
        plan([run(&JACOBI_PASS), run(&CLUMP_RESPONSE).when(clumps)]).when(!model.colored),
        swap(model, [(&COLORED_IMPULSE, &COLORED_IMPULSE_BEFORE)]),
        swap(model, [(&IMPULSE, &IMPULSE_BEFORE)]).when(!model.colored || model.large_grains),
        swap(model, [(&PASS_VELOCITY, &PASS_VELOCITY_BEFORE), (&PASS_SPIN, &PASS_SPIN_BEFORE)]),
        run(&MOMENTUM_RESTART),
        run(&EXTRAPOLATE),
        clear([&COLOR_CURSOR]).when(model.colored),
    ])
}

/// The residual that the passes have left.
fn residual(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    plan([
        run(&SCATTER_IMPULSES).when(model.colored),
        run(&GATHER_IMPULSES),
        run(&REFRESH_MEMBERS).when(clumps),
        run(&RESIDUAL),
        run(&REDUCE_RESIDUAL),
    ])
}

/// Positions to the end of the step.
pub fn motion(model: &Model) -> Plan {
    let clumps = model.grains == Grains::Clumps;
    plan([
        run(&DEFORM_CELL).when(model.boundary == Boundary::Deforming),
        run(&MOVE_SPHERES).when(!clumps),
        plan([run(&MEMBER_IMPULSES), run(&MOVE_CLUMPS), run(&MOVE_MEMBERS)]).when(clumps),
        space::motion(model),
        exchange(model),
        swap(model, [(&TANGENTIAL_FORCE, &TANGENTIAL_FORCE_NEXT)]).when(model.compliance == Compliance::Stiffness),
    ])
}
