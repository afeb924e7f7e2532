// twin: src/space/precision.rs
// Precision slot: with numbers in f32 a position is kept as a multiple of params.quantum (a few units in the last place
// of the scene's extent, a power of two) and a low part within half of that, so that slow motion far from the origin is
// not lost to rounding and small overlaps keep their digits. Owns the low parts. A compensated sum would not do:
// drivers may simplify (a + b) - a, but sums of multiples of a power of two are exact in whatever order.
var<storage, read> position_low: array<PositionLow>;            // N
var<storage, read_write> position_low_next: array<PositionLow>; // N

fn position_low_of(i: u32) -> PositionLow {
    return position_low[i];
}

fn store_position_low(i: u32, value: PositionLow) {
    position_low_next[i] = value;
}

/// Another low part of a radius, for what comes next.
fn store_radius_low(i: u32, low: Real) {
    position_low_next[i] = PositionLow(position_low_next[i].x, low);
}

/// (a + a_low) (b + b_low), split, with 35 bits: a and b have 12 bits, so that f32 holds their product exactly, and what
/// is left is small beside it. In units of the last place, as `accelerated`.
fn product_of(a: Real, a_low: Real, b: Real, b_low: Real) -> SplitReal {
    let product = a * b;
    let small = a * b_low + a_low * (b + b_low);
    let place = last_place(product + small);
    let at = product * place.inverse;
    let whole = round(at);
    let rest = fma(small, place.inverse, at - whole);
    let more = round(rest);
    return SplitReal(place.unit * (whole + more), place.unit * (rest - more));
}

/// x + low part + step, split anew.
fn displaced(x: Vec, low: Vec, step: Vec) -> Point {
    let y = low + step;
    let whole = params.quantum * floor(y * params.inverse_quantum + Vec(0.5));
    return Point(x + whole, y - whole);
}

/// x + low part, split anew: the quantum grows where grains go far, and x may be no multiple of it any more. Bodies see
/// to that when they are sorted, before which it may grow.
fn requantised(x: Vec, low: Vec) -> Point {
    let whole = params.quantum * round(x * params.inverse_quantum);
    return displaced(whole, (x - whole) + low, Vec());
}

/// The multiple of the quantum nearest to it.
fn on_grid(x: Vec) -> Vec {
    return params.quantum * round(x * params.inverse_quantum);
}

/// Of the step, for stochastic rounding.
var<private> seed: u32;

/// A hash of the step's number, so that no two steps have to do with each other (the finalizer of MurmurHash3).
fn set_seed(step: u32) {
    var bits = (step ^ (step >> 16u)) * 0x85ebca6bu;
    bits = (bits ^ (bits >> 13u)) * 0xc2b2ae35u;
    seed = bits ^ (bits >> 16u);
}

/// old + change, rounded up or down by chance, as often as the digits that this loses ask for (stochastic rounding; Croci
/// et al. 2022, R. Soc. Open Sci. 9, 211631): what grows in small steps and has no low part must not lose them the same way
/// in every step. Evenly spread numbers would not do in place of random ones, because a change depends on how the steps
/// before were rounded. In units of the last place of the largest component; no driver can merge terms across `trunc`. What
/// is turned around stays so, to the last bit.
fn accumulated(old: Vec, change: Vec) -> Vec {
    let place = last_place(max(largest_component(old + change), 0x1p-20 * largest_component(old)));
    let at = old * place.inverse;
    let whole = round(at);
    let rest = fma(change, Vec(place.inverse), at - whole);
    return place.unit * (whole + trunc(rest + sign(rest) * chance(old)));
}

/// Numbers within [0, 1): a hash of the step and of a spring, the same from both sides of a contact. What is fresh with
/// every step is the seed; the spring turns it, so that springs are not all rounded the same way.
fn chance(spring: Vec) -> Vec {
    let size = bitcast<Bits>(spring) & Bits(0x7fffffffu);
    return 0x1p-24 * Vec(((size ^ Bits(seed)) * Bits(0x9e3779b1u)) >> Bits(8u));
}

/// The same for a spin or a moment.
fn accumulated_spin(old: Spin, change: Spin) -> Spin {
    return as_spin(accumulated(as_vector(old), as_vector(change)));
}

/// |d + rest| - (a + b + radii_rest), with the digits that this subtraction would lose: it is (d² - s²) / (d + s), and
/// the leading 15 bits of the lengths are squared and cancelled as integers. d, a and b are exact, rest and radii_rest
/// are small, distance is |d + rest|. Surfaces that are far apart, where the squares may be too large for integers, lose
/// no digits that matter.
fn gap_between(d: Vec, rest: Vec, distance: Real, a: Real, b: Real, radii_rest: Real) -> Real {
    let d_whole = round(d * params.inverse_length_unit); // not floor(x + 0.5): both grains must get the same
    let d_rest = (d - params.length_unit * d_whole) + rest;
    let a_whole = round(a * params.inverse_length_unit);
    let b_whole = round(b * params.inverse_length_unit);
    let s_rest = (a - params.length_unit * a_whole) + (b - params.length_unit * b_whole) + radii_rest;
    let s_whole = a_whole + b_whole;
    let squares = Real(dot(Whole(d_whole), Whole(d_whole)) - i32(s_whole) * i32(s_whole));
    let mixed = dot(d_whole, d_rest) - s_whole * s_rest;
    let rests = dot(d_rest, d_rest) - s_rest * s_rest;
    let gap = (params.length_unit * (params.length_unit * squares + 2 * mixed) + rests) / (distance + (a + b));
    return select(gap, distance - (a + b), distance > Real(FAR_APART) * (a + b));
}

/// Squares of lengths of this part of a contact distance still are integers of 31 bits.
const FAR_APART = 1.25;

/// From a sphere to the plane below it: (d + rest) · normal - sphere, with low parts of the normal and of the radius. A
/// plane that is along no axis may be 10,000 times as far from its point as an overlap is deep, and the overlap is the
/// difference of all this and the radius. So d in quanta and the normal in units of 2^-22 are both split in two whole
/// numbers of 12 bits, whose products and their sums, where they cancel, f32 holds exactly in whatever order.
fn gap_to_plane(d: Vec, rest: Vec, normal: Vec, normal_low: Vec, sphere: Real, sphere_low: Real) -> Real {
    let d_whole = round(d * params.inverse_quantum);
    let d_high = round(d_whole * 0x1p-12);
    let d_mid = d_whole - 4096 * d_high;
    let n_whole = round(normal * 0x1p22);
    let n_high = round(n_whole * 0x1p-11);
    let n_mid = n_whole - 2048 * n_high;
    let r_whole = round(sphere * params.inverse_quantum);
    let r_high = floor(0.5 * r_whole);
    let r_mid = r_whole - 2 * r_high;
    let mixed = 2 * dot(d_high, n_mid) + (dot(d_mid, n_high) - 2048 * r_mid);
    let whole = (4096 * (dot(d_high, n_high) - r_high) + mixed) * 2048 + dot(d_mid, n_mid);
    let d_rest = (d - params.quantum * d_whole) + rest;
    let n_rest = (normal - 0x1p-22 * n_whole) + normal_low;
    let rests = (dot(d, n_rest) + dot(d_rest, normal)) - ((sphere - params.quantum * r_whole) + sphere_low);
    return (0x1p-22 * params.quantum) * whole + rests;
}

/// From a sphere to the cylinder around it: radius - distance - sphere, with low parts of both radii, by squares as
/// `gap_between`, but with 24 bits of the lengths as whole numbers, because a vessel may be 10,000 times as wide as an
/// overlap is deep. d + rest is from the axis to the sphere, distance its length.
fn gap_in_cylinder(
    d: Real2,
    rest: Real2,
    distance: Real,
    radius: Real,
    radius_low: Real,
    sphere: Real,
    sphere_low: Real,
) -> Real {
    let place = last_place(radius);
    let d_round = round(d * place.inverse);
    let sphere_round = round(sphere * place.inverse);
    // In units of the radius' last place: s is where the sphere's centre would touch, d where it is.
    let d_rest = ((d - place.unit * d_round) + rest) * place.inverse;
    let s_rest = ((radius_low - (sphere - place.unit * sphere_round)) - sphere_low) * place.inverse;
    let s_round = radius * place.inverse - sphere_round;
    let s = i32(s_round);
    let c = vec2<i32>(clamp(d_round, Real2(-0x1p26), Real2(0x1p26))); // squares of what is left of 12 bits fit
    let s_high = s >> 12u;
    let s_mid = s & 4095;
    let c_high = c >> vec2<u32>(12u);
    let c_mid = c & vec2<i32>(4095);
    let highest = s_high * s_high - dot(c_high, c_high);
    if (max(highest, -highest) > (1 << 19u)) {
        return ((radius - distance) - sphere) + (radius_low - sphere_low); // far from it: there is nothing to lose
    }
    let upper = highest * 2048 + (s_high * s_mid - dot(c_high, c_mid));
    let lower = s_mid * s_mid - dot(c_mid, c_mid);
    let squares = (Real(upper) * 8192 + Real(lower >> 12u) * 4096) + Real(lower & 4095);
    let mixed = s_round * s_rest - dot(d_round, d_rest);
    let rests = s_rest * s_rest - dot(d_rest, d_rest);
    return place.unit * (((squares + 2 * mixed) + rests) / (((radius - sphere) + distance) * place.inverse));
}

var<storage, read> center_low: array<Vec>;                      // C, m
var<storage, read_write> center_low_next: array<Vec>;           // C
// C: without it a clump that turns by less than 1e-7 a step would stand still.
var<storage, read> orientation_low: array<Orientation>;
var<storage, read_write> orientation_low_next: array<Orientation>; // C

fn center_low_of(c: u32) -> Vec {
    return center_low[c];
}

fn store_center_low(c: u32, value: Vec) {
    center_low_next[c] = value;
}

fn center_low_next_of(c: u32) -> Vec {
    return center_low_next[c];
}

// C: too little to turn anything, until it amounts to a unit of the low part.
var<storage, read> orientation_rest: array<Orientation>;
var<storage, read_write> orientation_rest_next: array<Orientation>; // C

fn orientation_rest_of(c: u32) -> Orientation {
    return orientation_rest[c];
}

fn store_orientation_rest(c: u32, value: Orientation) {
    orientation_rest_next[c] = value;
}

fn orientation_low_of(c: u32) -> Orientation {
    return orientation_low[c];
}

fn store_orientation_low(c: u32, value: Orientation) {
    orientation_low_next[c] = value;
}

fn orientation_low_next_of(c: u32) -> Orientation {
    return orientation_low_next[c];
}

/// What attitudes are kept as multiples of: the rest is their low part. Products of two are whole multiples of its
/// square, which f32 holds exactly.
const ATTITUDE_QUANTUM: Real = 0x1p-11;
const ATTITUDE_SQUARE: Real = 0x1p-22;
// Not divisions, which a device may round.
const INVERSE_ATTITUDE_QUANTUM: Real = 2048;
const INVERSE_ATTITUDE_SQUARE: Real = 4194304;

/// 1 - |q|² of q + low part, with the digits that this subtraction would lose: its leading part is that of whole
/// numbers.
fn norm_defect(q: Orientation, low: Orientation) -> Real {
    let whole = i32(INVERSE_ATTITUDE_SQUARE) - square_of_whole(round(q * INVERSE_ATTITUDE_QUANTUM));
    return Real(whole) * ATTITUDE_SQUARE - (2 * dot(q, low) + dot(low, low));
}

/// The end of an arm that is turned by q + low part, with 34 bits of the longest arm: as with a matrix in units of the
/// square of the attitudes' quantum and an arm in units of params.arm_unit, both split into 11 bits and 11 bits, so
/// that products and sums are whole numbers below 2^24, and what is left of matrix and arm. Whole numbers also part
/// what goes to the position's whole from what goes to its low part: drivers reorder sums of floats.
fn arm_end(center: Point, q: Orientation, low: Orientation, arm: Vec) -> Point {
    let exact = plus(identity(), 1, bilinear(q, q));
    let rest = plus(bilinear(q + low, low), 1, bilinear(q, low));
    let high_bits = floors(exact, INVERSE_ATTITUDE_QUANTUM);
    let low_bits = plus(floors(exact, INVERSE_ATTITUDE_SQUARE), -INVERSE_ATTITUDE_QUANTUM, high_bits);
    let units = round(arm * params.inverse_arm_unit);
    let arm_high = floor(units * ATTITUDE_QUANTUM);
    let arm_low = units - arm_high * INVERSE_ATTITUDE_QUANTUM;
    let first = parted(Whole(times(high_bits, arm_high)), params.arm_unit, params.arm_shift);
    let mixed = Whole(times(high_bits, arm_low) + times(low_bits, arm_high));
    let second = parted(mixed, params.arm_unit * ATTITUDE_QUANTUM, params.arm_shift_fine);
    let third = (params.arm_unit * ATTITUDE_SQUARE) * times(low_bits, arm_low);
    let left = times(rest, arm) + times(exact, arm - params.arm_unit * units);
    let small = (first.low + second.low) + (third + left);
    return displaced(center.x + (first.x + second.x), center.low, small);
}

/// So many units, parted into a multiple of the quantum, which is 2^shift units or less than one, and the rest.
fn parted(count: Whole, unit: Real, shift: u32) -> Point {
    let quanta = shifted_right(count + Whole((1 << shift) >> 1u), shift);
    let rest = count - quanta * Whole(1 << shift);
    return Point((unit * Real(1 << shift)) * Vec(quanta), unit * Vec(rest));
}

/// Low parts are multiples of this, which f32 holds exactly.
const FINE_ATTITUDE_QUANTUM: Real = 0x1p-34;
const INVERSE_FINE_ATTITUDE_QUANTUM: Real = 0x1p34;

/// q + low part + rest + step, split anew.
fn add_rotation(q: Orientation, low: Orientation, rest: Orientation, step: Orientation) -> SplitOrientation {
    let left = rest + step;
    let fine = FINE_ATTITUDE_QUANTUM * round(left * INVERSE_FINE_ATTITUDE_QUANTUM);
    let y = low + fine;
    let whole = ATTITUDE_QUANTUM * floor(y * INVERSE_ATTITUDE_QUANTUM + Orientation(0.5));
    return SplitOrientation(q + whole, y - whole, left - fine);
}

var<storage, read> velocity_low: array<VelocityLow>;            // N
var<storage, read_write> velocity_low_next: array<VelocityLow>; // N
var<storage, read> clump_velocity_low: array<VelocityLow>;            // C
var<storage, read_write> clump_velocity_low_next: array<VelocityLow>; // C

fn velocity_low_of(i: u32) -> VelocityLow {
    return velocity_low[i];
}

fn store_velocity_low(i: u32, value: VelocityLow) {
    velocity_low_next[i] = value;
}

fn clump_velocity_low_of(c: u32) -> VelocityLow {
    return clump_velocity_low[c];
}

fn store_clump_velocity_low(c: u32, value: VelocityLow) {
    clump_velocity_low_next[c] = value;
}

/// The unit in the last place of the largest component of a vector, and its inverse. They are powers of two, made of
/// the bits of the exponent; of very small vectors as of 2^-77.
struct LastPlace {
    unit: Real,
    inverse: Real,
}

fn last_place(largest: Real) -> LastPlace {
    let unit = max(bitcast<u32>(largest) & 0x7f800000u, 50u << 23u) - (23u << 23u);
    return LastPlace(bitcast<f32>(unit), bitcast<f32>((254u << 23u) - unit));
}

/// What turns a float below 2^22 into a whole number in the lowest bits of its sum with this.
const TO_BITS: Real = 0x1.8p23;

/// v + low part + step, split anew: into a number of f32, which is the velocity that all but this function know, and
/// what is left of changes too small for its digits, until they amount to one. Velocities that lost them would feel
/// no slow change, or feel it too much, the same way in every step.
fn accelerated(v: Vec, low: vec2<u32>, step: Vec) -> SplitVelocity {
    let size = largest_component(v);
    let place = last_place(max(largest_component(v + step), 0x1p-20 * size));
    let at = v * place.inverse;
    let whole = round(at);
    let unit = last_place(size).unit * place.inverse * (1 / LOW_PARTS);
    let rest = fma(step, Vec(place.inverse), fma(Vec(unpacked_low(low)), Vec(unit), at - whole));
    let more = round(rest);
    let next = place.unit * (whole + more);
    let parts = LOW_PARTS * (place.unit * last_place(largest_component(next)).inverse);
    return SplitVelocity(next, packed_low(bitcast<Bits>(fma(rest - more, Vec(parts), Vec(TO_BITS)))));
}

/// The same for a spin.
fn accelerated_spin(w: Spin, low: vec2<u32>, step: Spin) -> SplitSpin {
    let next = accelerated(as_vector(w), low, as_vector(step));
    return SplitSpin(as_spin(next.v), next.low);
}

/// What a velocity has beyond f32.
fn low_of(v: Vec, low: vec2<u32>) -> Vec {
    return (last_place(largest_component(v)).unit * (1 / LOW_PARTS)) * Vec(unpacked_low(low));
}

/// What a spin has beyond f32.
fn spin_low_of(w: Spin, low: vec2<u32>) -> Spin {
    return as_spin(low_of(as_vector(w), low));
}

/// Rounds that look for the change of a spin end when they move it by less than this part of it, see `has_settled`.
const SPIN_TOLERANCE: Real = 1e-6;
