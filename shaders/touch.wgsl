// twin: src/laws/touch.rs
// Geometry of two grains.

/// Gap and normal from grain i to grain j; `residue` is that of j less that of i. Coincident centres get an arbitrary axis, opposite for the two grains.
fn touch_grain(i: u32, j: u32, a: Place, b: Place, residue: Vec) -> Touch {
    let d = separation(a.x, b.x) + residue;
    let distance = sqrt(dot(d, d));
    if (distance == 0) {
        return Touch(-(a.radius + b.radius), select(-first_axis(), first_axis(), i < j));
    }
    return Touch(distance - (a.radius + b.radius), d / distance);
}

/// Unit vector along d; the other one where d has no length.
fn unit_or(d: Vec, other: Vec) -> Vec {
    let length_squared = dot(d, d);
    if (length_squared == 0) {
        return other;
    }
    return d / sqrt(length_squared);
}

/// Whether b belongs into the neighbour list of a. `slack` widens the reach a little: the counting pass uses it so
/// that rounding can never make the filling pass find more than was counted.
fn listed(a: Place, b: Place, slack: Real) -> bool {
    let d = separation(a.x, b.x);
    let reach = slack * (a.radius + b.radius + params.margin);
    return dot(d, d) < reach * reach;
}
