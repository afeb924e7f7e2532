// twin: src/laws/boundary.rs
// Boundary slot: at least one axis is periodic; period and inverse_period are 0 along the others, which switches
// every term below off without a branch.

/// From a to the nearest image of b, m.
fn separation(a: Vec, b: Vec) -> Vec {
    let d = b - a;
    return d - params.period * floor(d * params.inverse_period + Vec(0.5));
}

/// The representative of x inside the domain.
fn wrap(x: Vec) -> Vec {
    return x - params.period * floor((x - params.cell_origin) * params.inverse_period);
}
