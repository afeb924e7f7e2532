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
