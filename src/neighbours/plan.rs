//! Steps under neighbour lists. Nothing in them can go wrong without trace or return: lists that do not fit are not
//! walked and are made again; a step that uses up their margin halts those that follow.

use super::*;
use crate::{
    body::plan::exchange_bodies,
    model::{History, Levels, Model},
    plan::*,
    state::array::*,
};

/// New lists.
pub fn lists(model: &Model) -> Plan {
    plan([sort(model), repeat(Loop::UntilListsFit, plan([forget(), fill(model)]))])
}

/// New lists if the old ones have served, then steps, and how far they have brought the grains. All of it is submitted
/// before the host learns whether the lists fit: under lists that do not, and when halted, a step does nothing but its
/// exchanges.
pub fn chunk(model: &Model, step: &Plan) -> Plan {
    plan([
        repeat(Loop::IfListsAreUsedUp, sort(model)),
        repeat(
            Loop::UntilListsFit,
            plan([
                forget(),
                repeat(Loop::IfGrainsAreSorted, fill(model)),
                repeat(Loop::Steps, step.clone()),
                run(&DISPLACEMENT_CHECK),
                repeat(Loop::HaltedSteps, swap_again(&step.swaps())),
            ]),
        ),
    ])
}

/// What the device is to tell the host, forgotten.
pub fn forget() -> Plan {
    clear([&COUNTERS, &HALT, &HALT_NEXT])
}

/// Bodies into the order of the cells, what contacts remember to the history. In this order, as what bodies were before
/// is of no use any more then, and the history lies there; the lists know bodies as they were.
fn sort(model: &Model) -> Plan {
    let remembering = model.history == History::Kept;
    plan([
        clear([&CELL_START]),
        run(&BIN),
        run_all(&SCAN_CELLS),
        run(&SORT),
        run(&ORDER_CELLS),
        run(&PERMUTE),
        swap(model, [(&ID, &ID_NEXT)]),
        exchange_bodies(model),
        plan([run(&HISTORY_COUNT), run_all(&SCAN_HISTORY), run(&HISTORY_STORE)]).when(remembering),
    ])
}

/// Neighbour lists of sorted grains, with the history of their contacts.
fn fill(model: &Model) -> Plan {
    let several = model.levels == Levels::Several;
    plan([
        plan([clear([&ACROSS, &ACROSS_FILLED]), run(&COUNT_ACROSS_LEVELS)]).when(several),
        clear([&LIST_START]),
        run(&COUNT_NEIGHBOURS),
        run_all(&SCAN_LISTS),
        run(&FILL_NEIGHBOURS),
        run(&FILL_ACROSS_LEVELS).when(several),
        run(&ORDER_NEIGHBOURS),
        run(&ORDER_LONG_LISTS).when(model.large_grains),
    ])
}
