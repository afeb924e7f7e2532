// twin: src/laws/boundary.rs
// Boundary slot: at least one axis is periodic; period and inverse_period are 0 along the others, which switches
// every term below off without a branch.

/// From a to the nearest image of b, m.
fn separation(a: Vec, b: Vec) -> Vec {
    let d = b - a;
    let k = floor(d * params.inverse_period + Vec(0.5));
    return (d - params.period * k) - params.period_rest * k;
}

/// Which image of the domain x lies in, in periods per axis.
fn image(x: Vec) -> Vec {
    return floor((x - params.cell_origin) * params.inverse_period);
}
