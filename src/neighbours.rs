//! Neighbours: binning, sorting, lists, and what contacts remember while lists are made anew.

mod bin;
mod count_neighbours;
mod displacement_check;
mod fill_neighbours;
pub mod grid;
mod history_count;
mod history_store;
mod order_cells;
mod permute;
pub mod plan;
mod scan;
mod sort;

use crate::{stage::*, state::*};

/// History 1: contacts per grain.
pub static HISTORY_COUNT: Stage =
    Stage::new("neighbours", "history_count", history_count::history_count, bodies_plus_one);

/// Prefix sum of `history_start`.
pub static SCAN_HISTORY: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", &array::HISTORY_START)],
        ..Stage::new(
            "neighbours",
            "scan_reduce history_start",
            |s| scan::scan_reduce(&s.history_start, &mut s.tile_sum),
            |s| s.bodies / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", &array::HISTORY_START)],
        dispatch: Dispatch::OneGroup,
        ..Stage::new(
            "neighbours",
            "scan_top history_start",
            |s| scan::scan_top(&s.history_start, &mut s.tile_sum),
            |_| 1,
        )
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", &array::HISTORY_START)],
        ..Stage::new(
            "neighbours",
            "scan_down history_start",
            |s| scan::scan_down(&mut s.history_start, &s.tile_sum),
            |s| s.bodies / TILE + 1,
        )
    },
];

/// History 2: the contacts.
pub static HISTORY_STORE: Stage = Stage::new("neighbours", "history_store", history_store::history_store, bodies);

/// Broad phase 1: histogram over cells.
pub static BIN: Stage = Stage {
    check: Check { unordered: &[&array::CELL_RANK], ..Check::ROUNDING },
    ..Stage::new("neighbours", "bin", bin::bin, bodies)
};

/// Prefix sum of `cell_start`.
pub static SCAN_CELLS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", &array::CELL_START)],
        ..Stage::new(
            "neighbours",
            "scan_reduce cell_start",
            |s| scan::scan_reduce(&s.cell_start, &mut s.tile_sum),
            |s| s.cells / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", &array::CELL_START)],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("neighbours", "scan_top cell_start", |s| scan::scan_top(&s.cell_start, &mut s.tile_sum), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", &array::CELL_START)],
        ..Stage::new(
            "neighbours",
            "scan_down cell_start",
            |s| scan::scan_down(&mut s.cell_start, &s.tile_sum),
            |s| s.cells / TILE + 1,
        )
    },
];

/// Broad phase 2: scatter to cells.
pub static SORT: Stage = Stage {
    check: Check { unordered: &[&array::SORTED], ..Check::ROUNDING },
    ..Stage::new("neighbours", "sort", sort::sort, bodies)
};

/// Broad phase 3: ascending numbers inside cells.
pub static ORDER_CELLS: Stage = Stage::new("neighbours", "order_cells", order_cells::order_cells, |sizes| sizes.cells);

/// Broad phase 4: grains into that order.
pub static PERMUTE: Stage = Stage::new("neighbours", "permute", permute::permute, bodies);

/// Neighbour lists 1: entries per grain.
pub static COUNT_NEIGHBOURS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "count_neighbours", count_neighbours::count_neighbours, bodies_plus_one)
};

/// Prefix sum of `list_start`.
pub static SCAN_LISTS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", &array::LIST_START)],
        ..Stage::new(
            "neighbours",
            "scan_reduce list_start",
            |s| scan::scan_reduce(&s.list_start, &mut s.tile_sum),
            |s| s.bodies / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", &array::LIST_START)],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("neighbours", "scan_top list_start", |s| scan::scan_top(&s.list_start, &mut s.tile_sum), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", &array::LIST_START)],
        ..Stage::new(
            "neighbours",
            "scan_down list_start",
            |s| scan::scan_down(&mut s.list_start, &s.tile_sum),
            |s| s.bodies / TILE + 1,
        )
    },
];

/// Neighbour lists 2: entries and their history.
pub static FILL_NEIGHBOURS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "fill_neighbours", fill_neighbours::fill_neighbours, bodies)
};

/// How far grains went in a chunk, and how many active contacts there are.
pub static DISPLACEMENT_CHECK: Stage =
    Stage::new("neighbours", "displacement_check", displacement_check::displacement_check, bodies);
