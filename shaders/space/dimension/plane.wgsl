// twin: src/space/dimension.rs
// Dimension slot: disks of unit thickness in the plane; spin is the one component about z.
alias Vec = Real2;
alias Spin = Real;
alias Whole = vec2<i32>;
alias Bits = vec2<u32>;
const DIMENSIONS = 2u;

/// A vector without the padding that arrays of vectors may have.
struct Packed {
    x: Real,
    y: Real,
}

fn packed(v: Vec) -> Packed {
    return Packed(v.x, v.y);
}

fn unpacked(p: Packed) -> Vec {
    return Vec(p.x, p.y);
}

/// Parts of a unit in the last place that low parts of velocities are counted in.
const LOW_PARTS: f32 = 0x1p20;

/// So many of them for each component, in the lowest 22 bits.
fn packed_low(parts: Bits) -> vec2<u32> {
    return parts;
}

fn unpacked_low(bits: vec2<u32>) -> Whole {
    return bitcast<Whole>(bits << vec2<u32>(10u)) >> vec2<u32>(10u);
}

/// A spin with the form of a vector, and back.
fn as_vector(w: Spin) -> Vec {
    return Vec(w, 0);
}

fn as_spin(v: Vec) -> Spin {
    return v.x;
}

/// The largest component.
fn largest_component(v: Vec) -> Real {
    return max(max(v.x, -v.x), max(v.y, -v.y));
}

/// ω × R, the second term of (2.6).
fn spin_velocity(spin: Spin, arm: Vec) -> Vec {
    return spin * Vec(-arm.y, arm.x);
}

/// R × f, (2.3) and (2.16).
fn moment(arm: Vec, force: Vec) -> Spin {
    return arm.x * force.y - arm.y * force.x;
}

/// 1 / (J / m R²): J = 1/2 m R² for a disk.
const INVERSE_GYRATION: f32 = 2.0;

fn first_axis() -> Vec {
    return Vec(1, 0);
}

/// The two components around the vertical axis: all there are.
fn horizontal(x: Vec) -> Real2 {
    return x;
}

fn from_horizontal(x: Real2) -> Vec {
    return x;
}

/// The part of a spin across a direction in the plane: all of it.
fn across_spin(w: Spin, n: Vec) -> Spin {
    return w;
}

/// What a vector of the contact plane with normal n_before changes by, in the smallest rotation to that with normal n
/// (2.11).
fn transport(old: Vec, n: Vec, n_before: Vec) -> Vec {
    // The lower limit only matters for a grain that passed straight through another: there is no smallest rotation.
    return -dot(n, old) / max(1 + dot(n, n_before), 1e-6) * (n_before + n);
}

/// `transport` for a moment, which is about the axis out of the plane.
fn transport_spin(old: Spin, n: Vec, n_before: Vec) -> Spin {
    return 0;
}

fn outside(x: Vec, lower: Vec, upper: Vec) -> bool {
    return !(all(x >= lower) && all(x <= upper));
}

/// Cell of the grid, before wrapping: floor of the scaled position. There is one layer of cells.
fn cell_coordinates(scaled: Vec) -> vec3<i32> {
    return vec3<i32>(vec2<i32>(floor(scaled)), 0);
}

fn spin_dot(a: Spin, b: Spin) -> Real {
    return a * b;
}

fn spin_squared(spin: Spin) -> Real {
    return spin * spin;
}

/// Which of d and -d this is: exactly one of two opposite vectors points backward.
fn backward(d: Vec) -> bool {
    return d.x < 0 || (d.x == 0 && d.y < 0);
}

/// A unit complex number (z, w), the sine and cosine of half the angle, from the axes of a body to those of the scene.
alias Orientation = Real2;

/// The vector v of a body, along the axes of the scene.
fn rotate(q: Orientation, v: Vec) -> Vec {
    let t = 2 * q.x * Vec(-v.y, v.x);
    return v + (q.y * t + q.x * Vec(-t.y, t.x));
}

fn rotate_spin(q: Orientation, w: Spin) -> Spin {
    return w;
}

/// The way back.
fn conjugate(q: Orientation) -> Orientation {
    return Orientation(-q.x, q.y);
}

/// The product of complex numbers.
fn quaternion_product(a: Orientation, b: Orientation) -> Orientation {
    return Orientation(a.y * b.x + b.y * a.x, a.y * b.y - a.x * b.x);
}

/// The number of (2.40) less 1, of β = ω Δt/4 (2.42).
fn rotation_increment(beta: Spin) -> Orientation {
    let square = beta * beta;
    return Orientation(beta, -square) * (2 / (1 + square));
}

/// |q|² of whole numbers.
fn square_of_whole(q: Orientation) -> i32 {
    let whole = vec2<i32>(q);
    return dot(whole, whole);
}

/// Rounded down.
fn shifted_right(count: Whole, shift: u32) -> Whole {
    return count >> vec2<u32>(shift);
}

/// By how much the turn 1 + gain moves the end of an arm, m.
fn arm_increment(gain: Orientation, arm: Vec) -> Vec {
    let t = gain.x * Vec(-arm.y, arm.x);
    return 2 * ((1 + gain.y) * t + gain.x * Vec(-t.y, t.x));
}

/// A matrix.
struct Columns {
    x: Vec,
    y: Vec,
}

/// The bilinear form B for which I + B(q, q) is the rotation by q.
fn bilinear(q: Orientation, p: Orientation) -> Columns {
    let square = 2 * q.x * p.x;
    let mixed = q.x * p.y + q.y * p.x;
    return Columns(Vec(-square, mixed), Vec(-mixed, -square));
}

fn times(m: Columns, v: Vec) -> Vec {
    return v.x * m.x + v.y * m.y;
}

/// a + factor b.
fn plus(a: Columns, factor: Real, b: Columns) -> Columns {
    return Columns(a.x + factor * b.x, a.y + factor * b.y);
}

/// The largest whole numbers that are not above a part of these.
fn floors(a: Columns, part: Real) -> Columns {
    return Columns(floor(part * a.x), floor(part * a.y));
}

fn outer(a: Vec, b: Vec) -> Columns {
    return Columns(b.x * a, b.y * a);
}

/// Velocity of the end of an arm, m/s, for an impulse there of 1 N s along each axis, as far as it comes from the
/// turning of a body with this inverse moment.
fn rotational_block(q: Orientation, inverse_moment: Spin, arm: Vec) -> Columns {
    let z = spin_velocity(Spin(1), arm);
    return outer(inverse_moment * z, z);
}

/// The largest eigenvalue of a symmetric matrix.
fn largest_eigenvalue(m: Columns) -> Real {
    let mean = 0.5 * (m.x.x + m.y.y);
    let half = 0.5 * (m.x.x - m.y.y);
    return mean + sqrt(half * half + m.x.y * m.x.y);
}

fn identity() -> Columns {
    return Columns(Vec(1, 0), Vec(0, 1));
}

/// In the plane there are no products of angular velocities.
fn gyroscopic(w: Spin, inverse_moments: Spin) -> Spin {
    return 0;
}

fn largest(w: Spin) -> Real {
    return max(w, -w);
}

fn all_equal(w: Spin) -> bool {
    return true;
}

/// By how much the turn 1 + gain changes a vector of spin.
fn rotated_spin_change(gain: Orientation, w: Spin) -> Spin {
    return 0;
}

// Upper triangular matrices: the number above the diagonal is that of the first row and the second column.

/// What is above the diagonal, next to it, times a vector.
fn next_above(above: Spin, v: Vec) -> Vec {
    return Vec(above * v.y, 0);
}

/// The same of what is further above.
fn last_above(above: Spin, v: Vec) -> Vec {
    return Vec();
}

/// Above the diagonal of the outer product of two vectors.
fn outer_above(a: Vec, b: Vec) -> Spin {
    return a.x * b.y;
}

fn volume_of(length: Vec) -> Real {
    return length.x * length.y;
}

/// Above the diagonal of a product.
fn product_above(a: Vec, a_above: Spin, b: Vec, b_above: Spin) -> Spin {
    return a.x * b_above + a_above * b.y;
}

/// Above the diagonal of an inverse.
fn inverse_above(diagonal: Vec, above: Spin) -> Spin {
    return -above / (diagonal.x * diagonal.y);
}

fn row_lengths(diagonal: Vec, above: Spin) -> Vec {
    return Vec(sqrt(diagonal.x * diagonal.x + above * above), diagonal.y);
}

/// How many edges of a cell with these tilts bring a point into the box of its lengths.
fn whole_periods(d: Vec, inverse_length: Vec, tilt: Spin) -> Vec {
    let y = floor(d.y * inverse_length.y);
    return Vec(floor((d.x - y * tilt) * inverse_length.x), y);
}

/// How many lengths come off the tilts of a cell, so that none is longer than half of them.
fn excess_tilts(length: Vec, tilt: Spin) -> Spin {
    return round(tilt / length.x);
}

/// The tilts that so many of them are.
fn tilts_of(count: Spin, length: Vec, tilt: Spin) -> Spin {
    return count * length.x;
}

/// Above the diagonal of the inverse of a matrix of ones with so many of them taken off.
fn turned_back_by(count: Spin) -> Spin {
    return count;
}
