//! The levels of the hierarchical grid of a scene: how wide their cells are, and how many there are.

use crate::{
    body::blocks::BLOCK,
    model::{Model, Precision},
    neighbours::grid::HAIR,
    scene::{Assembly, Domain, SizeLevel},
    space::precision::{QUANTA_OF_SLACK, quantum},
    state::{Level, Params},
};
use glam::UVec3;

/// At most this many cells per grain of a level.
const CELLS_PER_GRAIN: u64 = 2;
/// Fewer cells than this are no matter.
const FEW_CELLS: u64 = 64;

/// The levels, with the axes and the number of cells that they share in `p`. Grains may be up to `range` from the origin.
pub fn levels(p: &mut Params, assembly: &Assembly, model: &Model, range: f64) -> Vec<Level> {
    // In single precision positions may be multiples of more some day.
    let single = model.precision == Precision::Single;
    let slack = if single { QUANTA_OF_SLACK * (quantum(range / 4.0) - p.quantum) } else { 0.0 };
    let sizes = assembly.size_levels();
    let mut levels: Vec<Level> = sizes
        .iter()
        .map(|size| {
            // As wide as the grains of a level reach, so that few cells surround a grain.
            let edge = HAIR * (2.0 * size.largest + p.margin + p.position_slack + slack);
            let mut level = Level { radius: size.largest, cells: UVec3::ONE, ..Level::default() };
            divide(&mut level, p, assembly, size, model.dims(), edge);
            limit_cells(&mut level, p, &assembly.domain, size.grains, model.dims());
            level
        })
        .collect();
    // The long way around last, so that what is near in space is near in memory.
    let most = levels.iter().zip(&sizes).max_by_key(|(_, size)| size.grains).expect("there are grains").0.cells;
    let mut axes = [0, 1, 2];
    axes.sort_by_key(|axis| if most[*axis] == 1 { u32::MAX } else { most[*axis] });
    p.axes = UVec3::from_array(axes.map(|axis| axis as u32));
    for (level, size) in levels.iter_mut().zip(&sizes) {
        level.cells = UVec3::from_array(axes.map(|axis| level.cells[axis]));
        level.first_cell = p.cells;
        level.strip = strip(level, size.grains);
        p.cells += level.cells.element_product();
    }
    p.levels = levels.len() as u32;
    levels
}

/// Rows of a strip: about as wide as the rows are many that a block of grains fills of it, so that blocks are compact.
fn strip(level: &Level, grains: usize) -> u32 {
    let rows = f64::from(level.cells.y * level.cells.z);
    let rows_of_block = BLOCK as f64 * rows / grains as f64;
    1 << (0.5 * rows_of_block.log2()).round().clamp(0.0, 31.0) as u32
}

/// Cells at least this wide, m.
fn divide(level: &mut Level, p: &Params, assembly: &Assembly, size: &SizeLevel, dims: usize, edge: f64) {
    for axis in 0..dims {
        if assembly.domain.periodic[axis] {
            level.cells[axis] = (p.period[axis] / edge).floor().clamp(1.0, 1e6) as u32;
            level.inverse_cell[axis] = f64::from(level.cells[axis]) / p.period[axis];
        } else {
            let own = assembly.grains.iter().filter(|g| (size.smallest..=size.largest).contains(&g.radius));
            let bounds =
                own.map(|g| g.position[axis]).fold((f64::INFINITY, f64::NEG_INFINITY), |b, x| (b.0.min(x), b.1.max(x)));
            level.cells[axis] = (((bounds.1 - bounds.0) / edge).floor() + 1.0).clamp(1.0, 1e6) as u32;
            level.inverse_cell[axis] = 1.0 / edge;
        }
    }
}

/// Fewer cells than there would be memory for.
fn limit_cells(level: &mut Level, p: &Params, domain: &Domain, grains: usize, dims: usize) {
    let budget = (CELLS_PER_GRAIN * grains as u64).max(FEW_CELLS);
    let total = |level: &Level| level.cells.as_u64vec3().element_product();
    let longest = |level: &Level, periodic: bool| {
        (0..dims)
            .filter(|a| domain.periodic[*a] == periodic)
            .max_by_key(|a| level.cells[*a])
            .filter(|a| level.cells[*a] > 3)
    };
    // Open axes wrap around, so fewer cells are always right; a sparse scene need not pay for its emptiness.
    while total(level) > budget
        && let Some(axis) = longest(level, false)
    {
        level.cells[axis] = level.cells[axis].div_ceil(2).max(3);
    }
    // A periodic axis must be divided exactly, so there emptiness is paid for with larger cells.
    while total(level) > 4 * budget
        && let Some(axis) = longest(level, true)
    {
        level.cells[axis] = level.cells[axis].div_ceil(2).max(3);
        level.inverse_cell[axis] = f64::from(level.cells[axis]) / p.period[axis];
    }
}
