// twin: src/laws/grid.rs
// The grid of the broad phase. It wraps around on every axis: exact for a periodic one; along an open one, far-away
// grains may share a cell, which costs a distance test and needs no bounding box.

/// Cell of a point.
fn cell_of(x: Vec) -> vec3<u32> {
    let size = vec3<i32>(params.cells);
    let c = cell_coordinates((x - params.cell_origin) * params.inverse_cell) % size;
    return vec3<u32>((c + size) % size);
}

fn cell_index(c: vec3<u32>) -> u32 {
    return c.x + params.cells.x * (c.y + params.cells.y * c.z);
}

/// How many different cells touch a cell, itself included.
fn around_count() -> u32 {
    let ring = min(params.cells, vec3<u32>(3u));
    return ring.x * ring.y * ring.z;
}

/// Index of the k-th cell around c; an axis of one or two cells is walked once, not thrice.
fn around(c: vec3<u32>, k: u32) -> u32 {
    let ring = min(params.cells, vec3<u32>(3u));
    let step = vec3<u32>(k % ring.x, (k / ring.x) % ring.y, k / (ring.x * ring.y));
    let moved = (c + params.cells - vec3<u32>(1u) + step) % params.cells;
    return cell_index(select(step, moved, params.cells >= vec3<u32>(3u)));
}
