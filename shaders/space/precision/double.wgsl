// twin: src/space/precision.rs
// Precision slot: with numbers in f64 a position has no low part.
fn position_low_of(i: u32) -> PositionLow {
    return PositionLow();
}

fn store_position_low(i: u32, value: PositionLow) {}

fn store_radius_low(i: u32, low: Real) {}

/// a b.
fn product_of(a: Real, a_low: Real, b: Real, b_low: Real) -> SplitReal {
    return SplitReal(a * b, 0);
}

/// x + step.
fn displaced(x: Vec, low: Vec, step: Vec) -> Point {
    return Point(x + step, Vec());
}

/// x itself.
fn on_grid(x: Vec) -> Vec {
    return x;
}

/// Nothing is lost that counts.
fn set_seed(step: u32) {}

/// old + change.
fn accumulated(old: Vec, change: Vec) -> Vec {
    return old + change;
}

/// The same for a spin or a moment.
fn accumulated_spin(old: Spin, change: Spin) -> Spin {
    return old + change;
}

fn requantised(x: Vec, low: Vec) -> Point {
    return Point(x, Vec());
}

/// Distance less the radii.
fn gap_between(d: Vec, rest: Vec, distance: Real, a: Real, b: Real, radii_rest: Real) -> Real {
    return distance - (a + b);
}

/// From a sphere to the plane below it.
fn gap_to_plane(d: Vec, rest: Vec, normal: Vec, normal_low: Vec, sphere: Real, sphere_low: Real) -> Real {
    return dot(d, normal) - sphere;
}

/// From a sphere to the cylinder around it.
fn gap_in_cylinder(
    d: Real2,
    rest: Real2,
    distance: Real,
    radius: Real,
    radius_low: Real,
    sphere: Real,
    sphere_low: Real,
) -> Real {
    return (radius - distance) - sphere;
}

fn center_low_of(c: u32) -> Vec {
    return Vec();
}

fn store_center_low(c: u32, value: Vec) {}

fn center_low_next_of(c: u32) -> Vec {
    return Vec();
}

fn orientation_rest_of(c: u32) -> Orientation {
    return Orientation();
}

fn store_orientation_rest(c: u32, value: Orientation) {}

fn orientation_low_of(c: u32) -> Orientation {
    return Orientation();
}

fn store_orientation_low(c: u32, value: Orientation) {}

fn orientation_low_next_of(c: u32) -> Orientation {
    return Orientation();
}

/// 1 - |q|².
fn norm_defect(q: Orientation, low: Orientation) -> Real {
    return 1 - dot(q, q);
}

/// The end of an arm that is turned by q.
fn arm_end(center: Point, q: Orientation, low: Orientation, arm: Vec) -> Point {
    return Point(center.x + rotate(q, arm), Vec());
}

/// q + step.
fn add_rotation(q: Orientation, low: Orientation, rest: Orientation, step: Orientation) -> SplitOrientation {
    return SplitOrientation(q + step, Orientation(), Orientation());
}

fn velocity_low_of(i: u32) -> VelocityLow {
    return VelocityLow();
}

fn store_velocity_low(i: u32, value: VelocityLow) {}

fn clump_velocity_low_of(c: u32) -> VelocityLow {
    return VelocityLow();
}

fn store_clump_velocity_low(c: u32, value: VelocityLow) {}

/// v + step.
fn accelerated(v: Vec, low: vec2<u32>, step: Vec) -> SplitVelocity {
    return SplitVelocity(v + step, vec2<u32>());
}

fn accelerated_spin(w: Spin, low: vec2<u32>, step: Spin) -> SplitSpin {
    return SplitSpin(w + step, vec2<u32>());
}

fn low_of(v: Vec, low: vec2<u32>) -> Vec {
    return Vec();
}

fn spin_low_of(w: Spin, low: vec2<u32>) -> Spin {
    return Spin();
}

/// Rounds that look for the change of a spin end when they move it by less than this part of it, see `has_settled`.
const SPIN_TOLERANCE: Real = 1e-12;
