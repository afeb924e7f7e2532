// twin: src/laws/touch.rs
// Geometry of two grains.

/// Gap and normal from grain i to grain j; `residue` is that of j less that of i. Coincident centres get an arbitrary
/// axis, opposite for the two grains.
fn touch_grain(i: u32, j: u32, a: Place, b: Place, residue: Vec) -> Touch {
    let p = between(a.x, b.x, residue);
    let d = p.x + p.residue;
    let distance = sqrt(dot(d, d));
    if (distance == 0) {
        return Touch(-(a.radius + b.radius), select(-first_axis(), first_axis(), number[i] < number[j]));
    }
    return Touch(gap_between(p.x, p.residue, distance, a.radius, b.radius), d / distance);
}

/// Unit vector along d; the other one where d has no length.
fn unit_or(d: Vec, other: Vec) -> Vec {
    let length_squared = dot(d, d);
    if (length_squared == 0) {
        return other;
    }
    return d / sqrt(length_squared);
}

/// Whether the surfaces are closer than this, m, judged without residues: true where these could decide.
fn within(a: Place, b: Place, gap: Real) -> bool {
    let d = between(a.x, b.x, Vec()).x;
    let reach = a.radius + b.radius + gap + params.blur;
    return dot(d, d) < reach * reach;
}
