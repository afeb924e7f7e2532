// twin: src/laws/boundary.rs
// Boundary slot: at least one axis is periodic; period and inverse_period are 0 along the others, which switches
// every term below off without a branch.

/// From a to the nearest image of b + residue: the part that is exact, and the rest.
fn between(a: Vec, b: Vec, residue: Vec) -> Point {
    let d = b - a;
    let k = floor(d * params.inverse_period + Vec(0.5));
    return Point(d - params.period * k, residue - params.period_rest * k);
}

/// The image of a point that lies in the domain.
fn wrapped(p: Point) -> Point {
    let k = floor((p.x - params.cell_origin) * params.inverse_period);
    return Point(p.x - params.period * k, p.residue - params.period_rest * k);
}
