// twin: src/laws/boundary.rs
// Boundary slot: no axis is periodic.

/// From a to b, m.
fn separation(a: Vec, b: Vec) -> Vec {
    return b - a;
}

/// The representative of x inside the domain.
fn wrap(x: Vec) -> Vec {
    return x;
}
