// twin: src/neighbours/grid.rs
// The hierarchical grid of the broad phase: grains of like size share a level, whose cells are as wide as its largest
// grains reach. A level wraps around on every axis: exact for a periodic one; along an open one, far-away grains may
// share a cell, which costs a distance test and needs no bounding box. Grains are stored in the order of the levels,
// finest first, and then of the cells, so those of a row of cells follow each other. Rows are in strips of some width,
// so that grains that follow each other fill compact blocks. The axes of the grid are those of space in another order.

/// A level of the grid.
struct Level {
    inverse_cell: Vec, // 1/m, per axis
    radius: Real,      // m, of its largest grain
    cells: vec3<u32>,  // per axis of the grid
    first_cell: u32,   // the cells of all levels follow each other
    strip: u32,        // rows, a power of two
}

var<storage, read> level: array<Level>;      // finest first
var<storage, read_write> sorted: array<u32>; // N: the index that each grain had before it was sorted

/// What is within reach by a hair is looked at too, so that rounding cannot hide a neighbour.
const HAIR = 1.001;

/// Cell of a place in the grid, by axis of the grid, before the grid wraps around.
fn cell_of(place: Vec, inverse_cell: Vec) -> vec3<i32> {
    let at = cell_coordinates(place * inverse_cell);
    return vec3<i32>(component(at, params.axes.x), component(at, params.axes.y), component(at, params.axes.z));
}

/// Chosen by hand, because devices put vectors with an index that is no constant into memory.
fn component(v: vec3<i32>, axis: u32) -> i32 {
    return select(select(v.x, v.y, axis == 1u), v.z, axis == 2u);
}

/// The rest of a division by the number of cells, from 0 up. The whole number of an integer division would be slow; that
/// of a quotient of floats may be off by one or, far away, by more.
fn wrapped(c: vec3<i32>, cells: vec3<u32>) -> vec3<u32> {
    let size = vec3<i32>(cells);
    var rest = once_around(c, size);
    while (any(rest < vec3<i32>()) || any(rest >= size)) {
        let times = floor(vec3<f32>(rest) / vec3<f32>(size));
        rest = once_around(rest - vec3<i32>(times) * size, size);
    }
    return vec3<u32>(rest);
}

fn once_around(c: vec3<i32>, size: vec3<i32>) -> vec3<i32> {
    let up = c + select(vec3<i32>(), size, c < vec3<i32>());
    return up - select(vec3<i32>(), size, up >= size);
}

/// Cell of a grain, among the cells of all levels.
fn cell_index(here: Position) -> u32 {
    let grid = level[level_of(here.radius)];
    let c = wrapped(cell_of(reduced(here.x), grid.inverse_cell), grid.cells);
    return row_start(grid, c.yz) + c.x;
}

/// The first cell of a row: strip by strip, and in each the second axis fastest.
fn row_start(grid: Level, row: vec2<u32>) -> u32 {
    let begin = row.x & ~(grid.strip - 1u);
    let width = min(grid.strip, grid.cells.y - begin);
    return grid.first_cell + grid.cells.x * (begin * grid.cells.z + row.y * width + (row.x - begin));
}

/// Cells of a level that surround a grain: on each axis so many from the first on, which wrap around.
struct Surroundings {
    first: vec3<u32>,
    count: vec3<u32>,
    grid: Level,
    row: vec2<u32>, // of the next span, from the first on
}

/// The cells of level k whose grains may be on the list of a grain.
fn surroundings(here: Position, k: u32) -> Surroundings {
    let grid = level[k];
    let reach = reduced_reach(HAIR * (here.radius + grid.radius + params.margin + params.position_slack));
    let place = reduced(here.x);
    let lower = cell_of(place - reach, grid.inverse_cell);
    let upper = cell_of(place + reach, grid.inverse_cell);
    let count = min(vec3<u32>(upper - lower) + vec3<u32>(1u), grid.cells);
    return Surroundings(wrapped(lower, grid.cells), count, grid, vec2<u32>());
}

/// How many spans of cells they are.
fn spans(around: Surroundings) -> u32 {
    return 2u * around.count.y * around.count.z;
}

/// The k-th span of cells: first, and one past the last. Every row has two: what comes before the end of the row, and
/// what lies around the corner. To be asked for one after the other.
fn span(around: ptr<function, Surroundings>, k: u32) -> vec2<u32> {
    let here = *around;
    let cells = here.grid.cells;
    var row = here.first.yz + here.row;
    row -= select(vec2<u32>(), cells.yz, row >= cells.yz);
    let begin = row_start(here.grid, row);
    let end = here.first.x + here.count.x;
    if (k % 2u == 0u) {
        return begin + vec2<u32>(here.first.x, min(end, cells.x));
    }
    let last = here.row.x + 1u == here.count.y;
    (*around).row = select(vec2<u32>(here.row.x + 1u, here.row.y), vec2<u32>(0u, here.row.y + 1u), last);
    return begin + vec2<u32>(0u, max(end, cells.x) - cells.x);
}

/// How much further than lists are filled their entries are counted, m, so that rounding can never make more of them
/// than were counted.
fn counting_slack(k: u32) -> Real {
    return 1e-5 * level[k].radius;
}
