// twin: src/laws/boundary.rs
// Boundary slot: no axis is periodic.

/// From a to b + residue: the part that is exact, and the rest.
fn between(a: Vec, b: Vec, residue: Vec) -> Point {
    return Point(b - a, residue);
}

/// The image of a point that lies in the domain.
fn wrapped(p: Point) -> Point {
    return p;
}
