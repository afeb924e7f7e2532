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

fn center_residue_of(c: u32) -> Vec {
    return Vec();
}

fn keep_center_residue(c: u32, value: Vec) {}

fn center_residue_next_of(c: u32) -> Vec {
    return Vec();
}

fn attitude_residue_of(c: u32) -> Attitude {
    return Attitude();
}

fn keep_attitude_residue(c: u32, value: Attitude) {}

fn attitude_residue_next_of(c: u32) -> Attitude {
    return Attitude();
}

/// 1 - |q|².
fn attitude_defect(q: Attitude, residue: Attitude) -> Real {
    return 1 - dot(q, q);
}

/// The end of an arm that is turned by q.
fn carried(center: Point, q: Attitude, residue: Attitude, arm: Vec) -> Point {
    return Point(center.x + turned(q, arm), Vec());
}

/// q + step.
fn turned_on(q: Attitude, residue: Attitude, step: Attitude) -> Turning {
    return Turning(q + step, Attitude());
}

/// Rounds of predictor and corrector end when they change Δω by less than this part of ω.
const SPIN_TOLERANCE: Real = 1e-12;
