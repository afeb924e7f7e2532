//! The kernels: one file per `shaders/*.wgsl` entry point, same name, with its CPU twin in f64.
//!
//! A twin is a function of one body mapped over all of them; nothing in it is clever enough to need reading twice.

mod bin;
mod contact;
mod count;
mod drift;
mod half_kick;
mod integrate;
mod measure;
mod move_walls;
mod neighbours;
mod order;
mod scan;
mod sort;

use crate::state::{PARTS, Sizes, State, TILE};

/// How many invocations a stage needs.
#[derive(Clone, Copy, Debug)]
pub enum Dispatch {
    /// One invocation per item.
    Items(fn(&Sizes) -> usize),
    /// A single workgroup.
    OneGroup,
}

/// One kernel: its name, its WGSL, its CPU twin, its dispatch size.
#[derive(Debug)]
pub struct Stage {
    /// Unique name, for plans, `check` and timings.
    pub name: &'static str,
    /// Entry point, and stem of the file in `shaders/`.
    pub kernel: &'static str,
    /// The same on the CPU, in f64.
    pub twin: fn(&mut State),
    pub dispatch: Dispatch,
    /// WGSL bindings that stand for an array of another name.
    pub bind: &'static [(&'static str, &'static str)],
    /// Arrays written whose order inside a cell is arbitrary until `order` has run; compared as multisets.
    pub unordered: &'static [&'static str],
}

impl Stage {
    const fn new(name: &'static str, twin: fn(&mut State), items: fn(&Sizes) -> usize) -> Stage {
        Stage { name, kernel: name, twin, dispatch: Dispatch::Items(items), bind: &[], unordered: &[] }
    }

    /// The array a WGSL binding stands for.
    pub fn array<'a>(&self, binding: &'a str) -> &'a str {
        self.bind.iter().find(|(from, _)| *from == binding).map_or(binding, |(_, to)| to)
    }
}

fn bodies(sizes: &Sizes) -> usize {
    sizes.bodies
}

/// Broad phase 1: histogram over cells.
pub static BIN: Stage = Stage { unordered: &["rank"], ..Stage::new("bin", bin::bin, bodies) };
/// Broad phase 2: scatter to cells.
pub static SORT: Stage = Stage { unordered: &["sorted"], ..Stage::new("sort", sort::sort, bodies) };
/// Broad phase 3: ascending ids inside cells.
pub static ORDER: Stage = Stage::new("order", order::order, |sizes| sizes.cells);
/// Prefix sum of `cell_start`.
pub static SCAN_CELLS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", "cell_start")],
        ..Stage::new(
            "scan_reduce cell_start",
            |s| scan::scan_reduce(&s.cell_start, &mut s.tile),
            |s| s.cells / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", "cell_start")],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("scan_top cell_start", |s| scan::scan_top(&s.cell_start, &mut s.tile), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", "cell_start")],
        ..Stage::new("scan_down cell_start", |s| scan::scan_down(&mut s.cell_start, &s.tile), |s| s.cells / TILE + 1)
    },
];
/// Neighbour lists 1: slots per grain.
pub static COUNT: Stage = Stage::new("count", count::count, bodies);
/// Prefix sum of `slot_start`.
pub static SCAN_SLOTS: [Stage; 3] = [
    Stage {
        kernel: "scan_reduce",
        bind: &[("values", "slot_start")],
        ..Stage::new(
            "scan_reduce slot_start",
            |s| scan::scan_reduce(&s.slot_start, &mut s.tile),
            |s| s.bodies / TILE + 1,
        )
    },
    Stage {
        kernel: "scan_top",
        bind: &[("values", "slot_start")],
        dispatch: Dispatch::OneGroup,
        ..Stage::new("scan_top slot_start", |s| scan::scan_top(&s.slot_start, &mut s.tile), |_| 1)
    },
    Stage {
        kernel: "scan_down",
        bind: &[("values", "slot_start")],
        ..Stage::new("scan_down slot_start", |s| scan::scan_down(&mut s.slot_start, &s.tile), |s| s.bodies / TILE + 1)
    },
];
/// Neighbour lists 2: ids and springs.
pub static NEIGHBOURS: Stage = Stage::new("neighbours", neighbours::neighbours, bodies);
/// Contact forces and moments.
pub static CONTACT: Stage = Stage::new("contact", contact::contact, bodies);
/// Leapfrog.
pub static INTEGRATE: Stage = Stage::new("integrate", integrate::integrate, bodies);
/// Velocities from 0 to -1/2.
pub static HALF_KICK: Stage = Stage::new("half_kick", half_kick::half_kick, bodies);
/// Moving walls.
pub static MOVE_WALLS: Stage = Stage::new("move_walls", move_walls::move_walls, |sizes| sizes.walls);
/// How far grains moved in a chunk.
pub static DRIFT: Stage = Stage::new("drift", drift::drift, bodies);
/// Sums over grains.
pub static MEASURE: Stage = Stage::new("measure", measure::measure, |_| PARTS);

/// One mutable slice per grain of an array over slots; empty slices where the model has no such array.
fn rows<'a, T>(slots: &'a mut [T], slot_start: &[u32]) -> Vec<&'a mut [T]> {
    let absent = slots.is_empty();
    let mut rest = slots;
    slot_start
        .windows(2)
        .map(|w| {
            let len = if absent { 0 } else { (w[1] - w[0]) as usize };
            let (row, tail) = std::mem::take(&mut rest).split_at_mut(len);
            rest = tail;
            row
        })
        .collect()
}
