// twin: src/laws/touch.rs
// Geometry of two grains.

/// Gap and normal of grains i and j, between which lies `way`. Coincident centres get an arbitrary axis, opposite for the
/// two grains.
fn touch_grain(i: u32, j: u32, way: Point, a: Real, b: Real, radii_rest: Real) -> Touch {
    let d = way.x + way.residue;
    let distance = sqrt(dot(d, d));
    if (distance == 0) {
        return Touch(-(a + b), select(-first_axis(), first_axis(), number[i] < number[j]));
    }
    return Touch(gap_between(way.x, way.residue, distance, a, b, radii_rest), d * (1 / distance));
}

/// Unit vector along d; the other one where d has no length.
fn unit_or(d: Vec, other: Vec) -> Vec {
    let length_squared = dot(d, d);
    if (length_squared == 0) {
        return other;
    }
    return d * (1 / sqrt(length_squared));
}

/// Whether the surfaces are closer than this, m, judged without residues: true where these could decide.
fn within(a: Place, b: Place, gap: Real) -> bool {
    let d = between(a.x, b.x, Vec()).x;
    let reach = a.radius + b.radius + gap + params.blur;
    return dot(d, d) < reach * reach;
}
