// twin: src/space/boundary.rs
// Boundary slot: no axis is periodic.

/// From a to b + low part: the part that is exact, and the rest.
fn nearest_image(a: Vec, b: Vec, low: Vec) -> Point {
    return Point(b - a, low);
}

/// The image of a point that lies in the domain.
fn wrap(p: Point) -> Point {
    return p;
}

/// A velocity past the flow of the cell, which stands still.
fn past_flow(v: Vec, d: Vec) -> Vec {
    return v;
}

/// The same of the flow of the step that bodies are doing.
fn past_next_flow(v: Vec, d: Vec) -> Vec {
    return v;
}

/// The velocity in space in a step from x with this one past the flow.
fn carried(x: Vec, v: Vec) -> Vec {
    return v;
}

/// What a grain that goes so far, m, takes of the margin of the lists.
fn approach(stride: Real, radius: Real) -> Real {
    return stride;
}

/// Where a point is in the grid.
fn reduced(x: Vec) -> Vec {
    return x - params.cell_origin;
}

/// How far points there can be from it that are no further than this from x, m.
fn reduced_reach(reach: Real) -> Vec {
    return Vec(reach);
}

/// Work of the flow on what has this virial, per time.
fn flow_power(virial: Vec, virial_above: Spin) -> Real {
    return 0;
}
