//! Neighbours: binning, sorting, lists, and what contacts remember while lists are made anew.

mod bin;
mod count_across_levels;
mod count_neighbours;
pub mod displacement_check;
mod entries;
mod fill_across_levels;
mod fill_neighbours;
pub mod found;
pub mod grid;
mod history_count;
mod history_store;
pub mod levels;
pub mod lists;
mod order_cells;
mod order_long_lists;
mod order_neighbours;
mod permute;
pub mod plan;
mod scan;
mod sort;

use crate::{stage::*, state::*};

fn cells(sizes: &Sizes) -> usize {
    sizes.cells
}

/// The stages of an exclusive prefix sum in place: of which array, and how many items it has one more than.
macro_rules! prefix_sum {
    ($handle:ident, $array:ident, $items:expr) => {
        [
            Stage {
                kernel: "scan_reduce",
                bind: &[("values", &array::$handle)],
                ..Stage::new(
                    "neighbours",
                    concat!("scan_reduce ", stringify!($array)),
                    |s| scan::scan_reduce(&s.$array, &mut s.tile_sum),
                    |sizes| $items(sizes) / TILE + 1,
                )
            },
            Stage {
                kernel: "scan_top",
                bind: &[("values", &array::$handle)],
                dispatch: Dispatch::OneGroup,
                ..Stage::new(
                    "neighbours",
                    concat!("scan_top ", stringify!($array)),
                    |s| scan::scan_top(&s.$array, &mut s.tile_sum),
                    |_| 1,
                )
            },
            Stage {
                kernel: "scan_down",
                bind: &[("values", &array::$handle)],
                ..Stage::new(
                    "neighbours",
                    concat!("scan_down ", stringify!($array)),
                    |s| scan::scan_down(&mut s.$array, &s.tile_sum),
                    |sizes| $items(sizes) / TILE + 1,
                )
            },
        ]
    };
}

/// History 1: contacts per grain.
pub static HISTORY_COUNT: Stage =
    Stage::new("neighbours", "history_count", history_count::history_count, bodies_plus_one);

/// Prefix sum of `history_start`.
pub static SCAN_HISTORY: [Stage; 3] = prefix_sum!(HISTORY_START, history_start, bodies);

/// History 2: the contacts.
pub static HISTORY_STORE: Stage = Stage::new("neighbours", "history_store", history_store::history_store, bodies);

/// Broad phase 1: histogram over cells.
pub static BIN: Stage = Stage {
    check: Check { unordered: &[&array::CELL_RANK], ..Check::ROUNDING },
    ..Stage::new("neighbours", "bin", bin::bin, bodies)
};

/// Prefix sum of `cell_start`.
pub static SCAN_CELLS: [Stage; 3] = prefix_sum!(CELL_START, cell_start, cells);

/// Broad phase 2: scatter to cells.
pub static SORT: Stage = Stage {
    check: Check { unordered: &[&array::SORTED], ..Check::ROUNDING },
    ..Stage::new("neighbours", "sort", sort::sort, bodies)
};

/// Broad phase 3: ascending numbers inside cells.
pub static ORDER_CELLS: Stage = Stage::new("neighbours", "order_cells", order_cells::order_cells, cells);

/// Broad phase 4: grains into that order.
pub static PERMUTE: Stage = Stage::new("neighbours", "permute", permute::permute, bodies);

/// Neighbour lists 1, of grains of many sizes: entries for neighbours on other levels.
pub static COUNT_ACROSS_LEVELS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "count_across_levels", count_across_levels::count_across_levels, bodies)
};

/// Neighbour lists 2: entries per slice.
pub static COUNT_NEIGHBOURS: Stage = Stage {
    bind: &[("slice_entries", &array::LIST_START)],
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "count_neighbours", count_neighbours::count_neighbours, bodies)
};

/// Prefix sum of `list_start`.
pub static SCAN_LISTS: [Stage; 3] = prefix_sum!(LIST_START, list_start, Sizes::slices);

/// Neighbour lists 3: neighbours on the own level.
pub static FILL_NEIGHBOURS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "fill_neighbours", fill_neighbours::fill_neighbours, bodies)
};

/// Neighbour lists 4, of grains of many sizes: neighbours on other levels.
pub static FILL_ACROSS_LEVELS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, unordered_lists: &[&array::NEIGHBOUR], ..Check::ROUNDING },
    ..Stage::new("neighbours", "fill_across_levels", fill_across_levels::fill_across_levels, bodies)
};

/// Neighbour lists 5: ascending ids, walls, history.
pub static ORDER_NEIGHBOURS: Stage = Stage {
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "order_neighbours", order_neighbours::order_neighbours, bodies)
};

/// The same of large grains.
pub static ORDER_LONG_LISTS: Stage = Stage {
    dispatch: Dispatch::GroupEach(large),
    check: Check { undecided: Undecided::Reach, ..Check::ROUNDING },
    ..Stage::new("neighbours", "order_long_lists", order_long_lists::order_long_lists, large)
};

/// How far grains went in a chunk, and how many active contacts there are.
pub static DISPLACEMENT_CHECK: Stage =
    Stage::new("neighbours", "displacement_check", displacement_check::displacement_check, bodies);
