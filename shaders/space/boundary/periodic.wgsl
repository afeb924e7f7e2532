// twin: src/space/boundary.rs
// Boundary slot: at least one axis is periodic; period and inverse_period are 0 along the others, which switches
// every term below off without a branch.

/// From a to the nearest image of b + low part: the part that is exact, and the rest.
fn nearest_image(a: Vec, b: Vec, low: Vec) -> Point {
    let d = b - a;
    let k = floor(d * params.inverse_period + Vec(0.5));
    return Point(d - params.period * k, low - params.period_low * k);
}

/// The image of a point that lies in the domain, split anew: what the period has beyond a multiple of the quantum would
/// leave low parts beyond half a quantum, and bits would depend on whether grains are sorted before they move on.
fn wrap(p: Point) -> Point {
    let k = floor((p.x - params.cell_origin) * params.inverse_period);
    return displaced(p.x - params.period * k, p.low, -params.period_low * k);
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
