// twin: src/laws/precision.rs
// Precision slot: with numbers in f64 a position has no residue.
fn residue_of(i: u32) -> Residue {
    return Residue();
}

fn keep_residue(i: u32, value: Residue) {}

/// x + step.
fn moved(x: Vec, residue: Vec, step: Vec) -> Point {
    return Point(x + step, Vec());
}

/// Distance less the radii.
fn gap_between(d: Vec, rest: Vec, distance: Real, a: Real, b: Real, radii_rest: Real) -> Real {
    return distance - (a + b);
}
