// twin: src/laws/precision.rs
// Precision slot: with numbers in f32 a position is kept as a multiple of params.quantum (a few units in the last place of
// the scene's extent, a power of two) and a residue within half of that, so that slow motion far from the origin is not
// lost to rounding and small overlaps keep their digits. Owns the residues. A compensated sum would not do: drivers may
// simplify (a + b) - a, but sums of multiples of a power of two are exact in whatever order.
var<storage, read> residue: array<Residue>;            // N
var<storage, read_write> residue_next: array<Residue>; // N

fn residue_of(i: u32) -> Residue {
    return residue[i];
}

fn keep_residue(i: u32, value: Residue) {
    residue_next[i] = value;
}

/// x + residue + step, split anew.
fn moved(x: Vec, residue: Vec, step: Vec) -> Point {
    let y = residue + step;
    let whole = params.quantum * floor(y * params.inverse_quantum + Vec(0.5));
    return Point(x + whole, y - whole);
}

/// |d + rest| - (a + b + radii_rest), with the digits that this subtraction would lose: it is (d² - s²) / (d + s), and the leading 15
/// bits of the lengths are squared and cancelled as integers. d, a and b are exact, rest and radii_rest are small, distance
/// is |d + rest|.
fn gap_between(d: Vec, rest: Vec, distance: Real, a: Real, b: Real, radii_rest: Real) -> Real {
    let d_whole = round(d * params.inverse_split); // not floor(x + 0.5): both grains must get the same
    let d_rest = (d - params.split * d_whole) + rest;
    let a_whole = round(a * params.inverse_split);
    let b_whole = round(b * params.inverse_split);
    let s_rest = (a - params.split * a_whole) + (b - params.split * b_whole) + radii_rest;
    let s_whole = a_whole + b_whole;
    let squares = Real(dot(Whole(d_whole), Whole(d_whole)) - i32(s_whole) * i32(s_whole));
    let mixed = dot(d_whole, d_rest) - s_whole * s_rest;
    let rests = dot(d_rest, d_rest) - s_rest * s_rest;
    return (params.split * (params.split * squares + 2 * mixed) + rests) / (distance + (a + b));
}

var<storage, read> center_residue: array<Vec>;                      // C, m
var<storage, read_write> center_residue_next: array<Vec>;           // C
var<storage, read> attitude_residue: array<Attitude>;               // C: without it a clump that turns by less than 1e-7 a step would stand still
var<storage, read_write> attitude_residue_next: array<Attitude>;    // C

fn center_residue_of(c: u32) -> Vec {
    return center_residue[c];
}

fn keep_center_residue(c: u32, value: Vec) {
    center_residue_next[c] = value;
}

fn center_residue_next_of(c: u32) -> Vec {
    return center_residue_next[c];
}

fn attitude_residue_of(c: u32) -> Attitude {
    return attitude_residue[c];
}

fn keep_attitude_residue(c: u32, value: Attitude) {
    attitude_residue_next[c] = value;
}

fn attitude_residue_next_of(c: u32) -> Attitude {
    return attitude_residue_next[c];
}

/// What attitudes are kept as multiples of: the rest is their residue. Products of two are whole multiples of its square, which
/// f32 holds exactly.
const ATTITUDE_QUANTUM: Real = 0x1p-11;
const ATTITUDE_SQUARE: Real = 0x1p-22;
// Not divisions, which a device may round.
const INVERSE_ATTITUDE_QUANTUM: Real = 2048;
const INVERSE_ATTITUDE_SQUARE: Real = 4194304;

/// 1 - |q|² of q + residue, with the digits that this subtraction would lose: its leading part is that of whole numbers.
fn attitude_defect(q: Attitude, residue: Attitude) -> Real {
    let whole = i32(INVERSE_ATTITUDE_SQUARE) - square_of_whole(round(q * INVERSE_ATTITUDE_QUANTUM));
    return Real(whole) * ATTITUDE_SQUARE - (2 * dot(q, residue) + dot(residue, residue));
}

/// The end of an arm that is turned by q + residue, with 34 bits of the longest arm: as with a matrix in units of the square of the
/// attitudes' quantum and an arm in units of params.arm_unit, both split into 11 bits and 11 bits, so that products and sums are
/// whole numbers below 2^24, and what is left of matrix and arm. Whole numbers also part what goes to the position's whole from what
/// goes to its residue: drivers reorder sums of floats.
fn carried(center: Point, q: Attitude, residue: Attitude, arm: Vec) -> Point {
    let exact = plus(identity(), 1, bilinear(q, q));
    let rest = plus(bilinear(q + residue, residue), 1, bilinear(q, residue));
    let high = floors(exact, INVERSE_ATTITUDE_QUANTUM);
    let low = plus(floors(exact, INVERSE_ATTITUDE_SQUARE), -INVERSE_ATTITUDE_QUANTUM, high);
    let units = round(arm * params.inverse_arm_unit);
    let arm_high = floor(units * ATTITUDE_QUANTUM);
    let arm_low = units - arm_high * INVERSE_ATTITUDE_QUANTUM;
    let first = parted(Whole(times(high, arm_high)), params.arm_unit, params.arm_shift);
    let mixed = Whole(times(high, arm_low) + times(low, arm_high));
    let second = parted(mixed, params.arm_unit * ATTITUDE_QUANTUM, params.arm_shift_fine);
    let third = (params.arm_unit * ATTITUDE_SQUARE) * times(low, arm_low);
    let left = times(rest, arm) + times(exact, arm - params.arm_unit * units);
    let small = (first.residue + second.residue) + (third + left);
    return moved(center.x + (first.x + second.x), center.residue, small);
}

/// So many units, parted into a multiple of the quantum, which is 2^shift units or less than one, and the rest.
fn parted(count: Whole, unit: Real, shift: u32) -> Point {
    let quanta = shifted_right(count + Whole((1 << shift) >> 1u), shift);
    let rest = count - quanta * Whole(1 << shift);
    return Point((unit * Real(1 << shift)) * Vec(quanta), unit * Vec(rest));
}

/// q + residue + step, split anew.
fn turned_on(q: Attitude, residue: Attitude, step: Attitude) -> Turning {
    let y = residue + step;
    let whole = ATTITUDE_QUANTUM * floor(y * INVERSE_ATTITUDE_QUANTUM + Attitude(0.5));
    return Turning(q + whole, y - whole);
}

/// Rounds of predictor and corrector end when they change Δω by less than this part of ω.
const SPIN_TOLERANCE: Real = 1e-6;
