// twin: src/laws/boundary.rs
// Boundary slot: no axis is periodic.

/// From a to b, m.
fn separation(a: Vec, b: Vec) -> Vec {
    return b - a;
}

/// Which image of the domain x lies in, in periods per axis.
fn image(x: Vec) -> Vec {
    return Vec();
}
