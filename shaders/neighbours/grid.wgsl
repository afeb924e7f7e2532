// twin: src/neighbours/grid.rs
// The grid of the broad phase. It wraps around on every axis: exact for a periodic one; along an open one, far-away
// grains may share a cell, which costs a distance test and needs no bounding box. Grains are stored in the order of the
// cells, so those of a row of cells follow each other. The grid's axes are those of space in another order.

var<storage, read_write> sorted: array<u32>; // N: the index that each grain had before it was sorted

/// Cell of a point, by axis of the grid.
fn cell_of(x: Vec) -> vec3<u32> {
    let size = vec3<i32>(params.cells);
    let at = cell_coordinates((x - params.cell_origin) * params.inverse_cell);
    let c = vec3<i32>(at[params.axes.x], at[params.axes.y], at[params.axes.z]) % size;
    return vec3<u32>((c + size) % size);
}

fn cell_index(c: vec3<u32>) -> u32 {
    return c.x + params.cells.x * (c.y + params.cells.y * c.z);
}

/// How many spans of cells surround a cell; an axis of one or two cells is walked once, not thrice.
fn spans() -> u32 {
    let rows = min(params.cells.yz, vec2<u32>(3u));
    return 2u * rows.x * rows.y;
}

/// The k-th span of cells around c: first, and one past the last. Every row has two: the cells next to c, and what
/// lies around the corner if c is at an end of the row.
fn span(c: vec3<u32>, k: u32) -> vec2<u32> {
    let size = params.cells;
    let rows = min(size.yz, vec2<u32>(3u));
    let step = vec2<u32>((k / 2u) % rows.x, k / 2u / rows.x);
    let moved = (c.yz + size.yz - vec2<u32>(1u) + step) % size.yz;
    let row = select(step, moved, size.yz >= vec2<u32>(3u));
    let begin = size.x * (row.x + size.y * row.y);
    let direct = k % 2u == 0u;
    if (size.x < 3u) {
        return begin + vec2<u32>(0u, select(0u, size.x, direct));
    }
    if (direct) {
        return begin + vec2<u32>(max(c.x, 1u) - 1u, min(c.x + 2u, size.x));
    }
    if (c.x == 0u) {
        return begin + vec2<u32>(size.x - 1u, size.x);
    }
    return begin + vec2<u32>(0u, select(0u, 1u, c.x == size.x - 1u));
}
