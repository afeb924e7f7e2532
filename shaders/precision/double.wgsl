// twin: src/laws/precision.rs
// Precision slot: numbers are f64 (device feature SHADER_F64). Only + - * /, sqrt, floor, min, max and dot are used on
// them: other f64 functions pass validation and return garbage on some drivers.
alias Real = f64;
alias Real2 = vec2<f64>;
alias Real3 = vec3<f64>;

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
