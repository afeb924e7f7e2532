// twin: src/space/dimension.rs
// Dimension slot: spheres in space.
alias Vec = Real3;
alias Spin = Real3;
alias Whole = vec3<i32>;
alias Bits = vec3<u32>;
const DIMENSIONS = 3u;

/// A vector without the padding that arrays of vectors have.
struct Packed {
    x: Real,
    y: Real,
    z: Real,
}

fn packed(v: Vec) -> Packed {
    return Packed(v.x, v.y, v.z);
}

fn unpacked(p: Packed) -> Vec {
    return Vec(p.x, p.y, p.z);
}

/// Parts of a unit in the last place that low parts of velocities are counted in: with the rounding of a whole unit,
/// and a sign, they are 21 bits.
const LOW_PARTS: f32 = 0x1p20 - 2;

/// So many of them for each component, in the lowest 22 bits: 21, 22 and 21 of them in 64 bits.
fn packed_low(p: Bits) -> vec2<u32> {
    return vec2<u32>((p.x & 0x1fffffu) | (p.y << 21u), ((p.y >> 11u) & 0x7ffu) | (p.z << 11u));
}

fn unpacked_low(bits: vec2<u32>) -> Whole {
    let y = (bits.x >> 21u) | (bits.y << 11u);
    return bitcast<Whole>(vec3<u32>(bits.x << 11u, y << 10u, bits.y)) >> vec3<u32>(11u, 10u, 11u);
}

/// A spin with the form of a vector, and back.
fn as_vector(w: Spin) -> Vec {
    return w;
}

fn as_spin(v: Vec) -> Spin {
    return v;
}

/// The largest component.
fn largest_component(v: Vec) -> Real {
    return largest(v);
}

/// ω × R, the second term of (2.6).
fn spin_velocity(spin: Spin, arm: Vec) -> Vec {
    return cross(spin, arm);
}

/// R × f, (2.3) and (2.16).
fn moment(arm: Vec, force: Vec) -> Spin {
    return cross(arm, force);
}

/// 1 / (J / m R²): J = 2/5 m R² for a sphere.
const INVERSE_GYRATION: f32 = 2.5;

fn first_axis() -> Vec {
    return Vec(1, 0, 0);
}

/// The two components around the vertical axis.
fn horizontal(x: Vec) -> Real2 {
    return x.xy;
}

fn from_horizontal(x: Real2) -> Vec {
    return Vec(x, 0);
}

/// The part of a spin across a direction: rolling without cross_terms.
fn across_spin(w: Spin, n: Vec) -> Spin {
    return w - dot(w, n) * n;
}

/// What a vector of the contact plane with normal n_before changes by, in the smallest rotation to that with normal n
/// (2.11).
fn transport(old: Vec, n: Vec, n_before: Vec) -> Vec {
    // The lower limit only matters for a grain that passed straight through another: there is no smallest rotation.
    return -dot(n, old) / max(1 + dot(n, n_before), 1e-6) * (n_before + n);
}

/// `transport` for a moment.
fn transport_spin(old: Spin, n: Vec, n_before: Vec) -> Spin {
    return transport(old, n, n_before);
}

fn outside(x: Vec, lower: Vec, upper: Vec) -> bool {
    return !(all(x >= lower) && all(x <= upper));
}

/// Cell of the grid, before wrapping: floor of the scaled position.
fn cell_coordinates(scaled: Vec) -> vec3<i32> {
    return vec3<i32>(floor(scaled));
}

fn spin_dot(a: Spin, b: Spin) -> Real {
    return dot(a, b);
}

fn spin_squared(spin: Spin) -> Real {
    return dot(spin, spin);
}

/// Which of d and -d this is: exactly one of two opposite vectors points backward.
fn backward(d: Vec) -> bool {
    return d.x < 0 || (d.x == 0 && (d.y < 0 || (d.y == 0 && d.z < 0)));
}

/// A unit quaternion (x, y, z, w), from the axes of a body to those of the scene.
alias Orientation = Real4;

/// The vector v of a body, along the axes of the scene.
fn rotate(q: Orientation, v: Vec) -> Vec {
    let t = 2 * cross(q.xyz, v);
    return v + (q.w * t + cross(q.xyz, t));
}

fn rotate_spin(q: Orientation, w: Spin) -> Spin {
    return rotate(q, w);
}

/// The way back.
fn conjugate(q: Orientation) -> Orientation {
    return Orientation(-q.xyz, q.w);
}

/// Hamilton's product.
fn quaternion_product(a: Orientation, b: Orientation) -> Orientation {
    return Orientation(a.w * b.xyz + b.w * a.xyz + cross(a.xyz, b.xyz), a.w * b.w - dot(a.xyz, b.xyz));
}

/// The quaternion of (2.40) less 1, of β = ω Δt/4 (2.42).
fn rotation_increment(beta: Spin) -> Orientation {
    let square = dot(beta, beta);
    return Orientation(beta, -square) * (2 / (1 + square));
}

/// |q|² of whole numbers.
fn square_of_whole(q: Orientation) -> i32 {
    let whole = vec4<i32>(q);
    return dot(whole, whole);
}

/// Rounded down.
fn shifted_right(count: Whole, shift: u32) -> Whole {
    return count >> vec3<u32>(shift);
}

/// By how much the turn 1 + gain moves the end of an arm, m.
fn arm_increment(gain: Orientation, arm: Vec) -> Vec {
    let t = cross(gain.xyz, arm);
    return 2 * ((1 + gain.w) * t + cross(gain.xyz, t));
}

/// A matrix.
struct Columns {
    x: Vec,
    y: Vec,
    z: Vec,
}

/// The bilinear form B for which I + B(q, q) is the rotation by q.
fn bilinear(q: Orientation, p: Orientation) -> Columns {
    let squares = 2 * q * p;
    let mixed = q.xyz * p.yzx + q.yzx * p.xyz; // xy, yz, zx
    let cross_terms = q.w * p.xyz + p.w * q.xyz;
    return Columns(
        Vec(-squares.y - squares.z, mixed.x + cross_terms.z, mixed.z - cross_terms.y),
        Vec(mixed.x - cross_terms.z, -squares.z - squares.x, mixed.y + cross_terms.x),
        Vec(mixed.z + cross_terms.y, mixed.y - cross_terms.x, -squares.x - squares.y),
    );
}

fn times(m: Columns, v: Vec) -> Vec {
    return v.x * m.x + (v.y * m.y + v.z * m.z);
}

/// a + factor b.
fn plus(a: Columns, factor: Real, b: Columns) -> Columns {
    return Columns(a.x + factor * b.x, a.y + factor * b.y, a.z + factor * b.z);
}

/// The largest whole numbers that are not above a part of these.
fn floors(a: Columns, part: Real) -> Columns {
    return Columns(floor(part * a.x), floor(part * a.y), floor(part * a.z));
}

fn outer(a: Vec, b: Vec) -> Columns {
    return Columns(b.x * a, b.y * a, b.z * a);
}

/// Velocity of the end of an arm, m/s, for an impulse there of 1 N s along each axis, as far as it comes from the
/// turning of a body with these inverse moments about its principal axes.
fn rotational_block(q: Orientation, inverse_moments: Spin, arm: Vec) -> Columns {
    let x = spin_velocity(rotate(q, Vec(1, 0, 0)), arm);
    let y = spin_velocity(rotate(q, Vec(0, 1, 0)), arm);
    let z = spin_velocity(rotate(q, Vec(0, 0, 1)), arm);
    let j = inverse_moments;
    return plus(plus(outer(j.x * x, x), j.y, outer(y, y)), j.z, outer(z, z));
}

/// The largest eigenvalue of a symmetric matrix, by Jacobi's rotations.
fn largest_eigenvalue(m: Columns) -> Real {
    var diagonal = Vec(m.x.x, m.y.y, m.z.z);
    let size = diagonal.x + diagonal.y + diagonal.z;
    if (!(size > 0)) {
        return 0;
    }
    diagonal /= size;
    var off = Vec(m.y.z, m.z.x, m.x.y) / size;
    for (var k = 0u; k < 15u; k++) {
        let square = off.z * off.z;
        if (square > 0) {
            let half = 0.5 * (diagonal.y - diagonal.x);
            let t = select(-off.z, off.z, half >= 0) / (max(half, -half) + sqrt(half * half + square));
            diagonal += t * off.z * Vec(-1, 1, 0);
            off = Vec(off.x + t * off.y, off.y - t * off.x, 0) / sqrt(1 + t * t);
        }
        // The next two axes.
        diagonal = diagonal.yzx;
        off = off.yzx;
    }
    return size * max(max(diagonal.x, diagonal.y), diagonal.z);
}

fn identity() -> Columns {
    return Columns(Vec(1, 0, 0), Vec(0, 1, 0), Vec(0, 0, 1));
}

/// The products of angular velocities in (2.21)-(2.23), N m.
fn gyroscopic(w: Spin, inverse_moments: Spin) -> Spin {
    let j = 1 / inverse_moments;
    return w.yzx * w.zxy * (j.yzx - j.zxy);
}

fn largest(w: Spin) -> Real {
    return max(max(max(w.x, -w.x), max(w.y, -w.y)), max(w.z, -w.z));
}

fn all_equal(w: Spin) -> bool {
    return w.x == w.y && w.y == w.z;
}

/// By how much the turn 1 + gain changes a vector of spin.
fn rotated_spin_change(gain: Orientation, w: Spin) -> Spin {
    return arm_increment(gain, w);
}

// Upper triangular matrices: the numbers above the diagonal are those of rows and columns y z, x z and x y.

/// What is above the diagonal, next to it, times a vector.
fn next_above(above: Spin, v: Vec) -> Vec {
    return Vec(above.z * v.y, above.x * v.z, 0);
}

/// The same of what is further above.
fn last_above(above: Spin, v: Vec) -> Vec {
    return Vec(above.y * v.z, 0, 0);
}

/// Above the diagonal of the outer product of two vectors.
fn outer_above(a: Vec, b: Vec) -> Spin {
    return Spin(a.y * b.z, a.x * b.z, a.x * b.y);
}

fn volume_of(length: Vec) -> Real {
    return length.x * length.y * length.z;
}

/// Above the diagonal of a product.
fn product_above(a: Vec, a_above: Spin, b: Vec, b_above: Spin) -> Spin {
    return Spin(
        a.y * b_above.x + a_above.x * b.z,
        (a.x * b_above.y + a_above.z * b_above.x) + a_above.y * b.z,
        a.x * b_above.z + a_above.z * b.y,
    );
}

/// Above the diagonal of an inverse.
fn inverse_above(diagonal: Vec, above: Spin) -> Spin {
    let yz = above.x / (diagonal.y * diagonal.z);
    let xy = above.z / (diagonal.x * diagonal.y);
    return Spin(-yz, (above.z * yz - above.y / diagonal.z) / diagonal.x, -xy);
}

fn row_lengths(diagonal: Vec, above: Spin) -> Vec {
    let x = Vec(diagonal.x, above.z, above.y);
    return Vec(sqrt(dot(x, x)), sqrt(diagonal.y * diagonal.y + above.x * above.x), diagonal.z);
}

/// How many edges of a cell with these tilts bring a point into the box of its lengths.
fn whole_periods(d: Vec, inverse_length: Vec, tilt: Spin) -> Vec {
    let z = floor(d.z * inverse_length.z);
    let y = floor((d.y - z * tilt.x) * inverse_length.y);
    return Vec(floor((d.x - z * tilt.y - y * tilt.z) * inverse_length.x), y, z);
}

/// How many lengths come off the tilts of a cell, so that none is longer than half of them.
fn excess_tilts(length: Vec, tilt: Spin) -> Spin {
    let yz = round(tilt.x / length.y);
    return Spin(yz, round((tilt.y - yz * tilt.z) / length.x), round(tilt.z / length.x));
}

/// The tilts that so many of them are.
fn tilts_of(count: Spin, length: Vec, tilt: Spin) -> Spin {
    return Spin(count.x * length.y, count.x * tilt.z + count.y * length.x, count.z * length.x);
}

/// Above the diagonal of the inverse of a matrix of ones with so many of them taken off.
fn turned_back_by(count: Spin) -> Spin {
    return Spin(count.x, count.y + count.z * count.x, count.z);
}
