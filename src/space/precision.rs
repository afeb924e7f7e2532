//! Twin of `shaders/space/precision/`: in single precision a position is a multiple of a quantum and a low part, and a
//! velocity has a low part too.

use crate::space::dimension::{largest, rotate};
use crate::{
    model::{Dimension, Precision},
    state::{LowBits, Params, PositionLow, State},
    units::Quantity,
};
use glam::{DVec3, DVec4, IVec3};

/// A position: in single precision a multiple of the quantum and a low part, m.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    pub x: DVec3,
    pub low: DVec3,
}

/// What grain i has beyond its place; nothing in double precision.
#[inline(always)]
pub fn position_low_of(s: &State, i: usize) -> PositionLow {
    s.position_low.get(i).copied().unwrap_or_default()
}

/// The multiple of the quantum nearest to d, m.
#[inline(always)]
pub fn quantised(p: &Params, d: DVec3) -> DVec3 {
    p.quantum * (d * p.inverse_quantum + DVec3::splat(0.5)).floor()
}

/// x + low part + step, split anew.
#[inline(always)]
pub fn displaced(s: &State, x: DVec3, low: DVec3, step: DVec3) -> Point {
    match s.model.precision {
        Precision::Double => Point { x: x + step, low: DVec3::ZERO },
        Precision::Single => {
            let y = low + step;
            let whole = quantised(&s.params, y);
            Point { x: x + whole, low: y - whole }
        }
    }
}

/// x + low part, split anew: the quantum grows where grains go far, and x may be no multiple of it any more. Bodies see
/// to that when they are sorted, before which it may grow.
pub fn requantised(s: &State, Point { x, low }: Point) -> Point {
    match s.model.precision {
        Precision::Double => Point { x, low },
        Precision::Single => {
            let whole = quantised(&s.params, x);
            displaced(s, whole, (x - whole) + low, DVec3::ZERO)
        }
    }
}

/// The multiple of the quantum nearest to a product in single precision; in double precision the product.
#[inline(always)]
pub fn on_grid(s: &State, product: DVec3) -> DVec3 {
    match s.model.precision {
        Precision::Double => product,
        Precision::Single => {
            let units = (product * s.params.inverse_quantum).as_vec3().to_array().map(f32::round_ties_even);
            s.params.quantum * DVec3::from_array(units.map(f64::from))
        }
    }
}

/// old + change. In single precision a device rounds it stochastically.
#[inline(always)]
pub fn accumulated(old: DVec3, change: DVec3) -> DVec3 {
    old + change
}

/// Distance less the radii, m. (In single precision the device takes pains for the digits that are lost in this.)
#[inline(always)]
pub fn gap_between(distance: f64, a: f64, b: f64, radii_rest: f64) -> f64 {
    distance - (a + b + radii_rest)
}

/// The quantum for coordinates up to `extent`: four units in the last place of f32, so that grains may go four times as
/// far before the sums lose anything.
pub fn quantum(extent: f64) -> f64 {
    2.0_f64.powi(extent.log2().ceil() as i32 - 22)
}

/// How far coordinates may go before sums of multiples of a quantum lose anything.
pub fn extent_of(quantum: f64) -> f64 {
    2.0_f64.powi(24) * quantum
}

/// What positions are multiples of while coordinates go up to `extent`, and what follows from that. It never becomes
/// finer, nor coarser than `coarsest`.
pub fn set_quantum(p: &mut Params, extent: f64, coarsest: f64) {
    p.quantum = quantum(extent).clamp(p.quantum.min(coarsest), coarsest);
    p.inverse_quantum = 1.0 / p.quantum;
    let shift = |unit: f64| (p.quantum / unit).log2().clamp(0.0, 26.0) as u32;
    (p.arm_shift, p.arm_shift_fine) = (shift(p.arm_unit), shift(p.arm_unit / 2048.0));
}

/// Distances may be off by so many quanta if low parts are left out, also after the quantum has doubled.
pub const QUANTA_OF_SLACK: f64 = 8.0;

/// Coordinates go up to `extent` by now.
pub fn follow_extent(p: &mut Params, extent: f64, coarsest: f64) {
    let before = p.quantum;
    set_quantum(p, extent, coarsest);
    p.position_slack += QUANTA_OF_SLACK * (p.quantum - before);
}

/// The unit of the leading 15 bits of lengths up to `reach`.
pub fn split(reach: f64) -> f64 {
    2.0_f64.powi(reach.log2().ceil() as i32 - 15)
}

/// An attitude: in single precision a multiple of a quantum, a low part that is one of a finer quantum, and a rest;
/// quaternions (x, y, z, w).
#[derive(Clone, Copy, Debug, Default)]
pub struct SplitOrientation {
    pub q: DVec4,
    pub low: DVec4,
    pub rest: DVec4,
}

/// What attitudes are kept as multiples of: the rest is their low part.
const ATTITUDE_QUANTUM: f64 = 1.0 / 2048.0;

/// 1 - |q|² of q + low part.
pub fn norm_defect(q: DVec4, low: DVec4) -> f64 {
    (1.0 - q.length_squared()) - (2.0 * q.dot(low) + low.length_squared())
}

/// The end of an arm that is turned by q + low part. (In single precision the device takes pains for its digits.)
#[inline(always)]
pub fn arm_end(s: &State, center: Point, q: DVec4, low: DVec4, arm: DVec3) -> Point {
    displaced(s, center.x, center.low, rotate(q + low, arm))
}

/// Low parts are multiples of this.
const FINE_ATTITUDE_QUANTUM: f64 = 1.0 / (1_u64 << 34) as f64;

/// q + low part + rest + step, split anew.
pub fn add_rotation(s: &State, from: &SplitOrientation, step: DVec4) -> SplitOrientation {
    match s.model.precision {
        Precision::Double => SplitOrientation { q: from.q + step, low: DVec4::ZERO, rest: DVec4::ZERO },
        Precision::Single => {
            let left = from.rest + step;
            let units = (left / FINE_ATTITUDE_QUANTUM).to_array().map(f64::round_ties_even);
            let fine = FINE_ATTITUDE_QUANTUM * DVec4::from_array(units);
            let y = from.low + fine;
            let whole = ATTITUDE_QUANTUM * (y * (1.0 / ATTITUDE_QUANTUM) + DVec4::splat(0.5)).floor();
            SplitOrientation { q: from.q + whole, low: y - whole, rest: left - fine }
        }
    }
}

/// Parts of a unit in the last place that low parts of velocities are counted in.
fn low_parts(dimension: Dimension) -> f64 {
    match dimension {
        Dimension::Plane => 2.0_f64.powi(20),
        Dimension::Space => 2.0_f64.powi(20) - 2.0,
    }
}

/// So many of them for each component, in 64 bits: 22 of each in the plane, where a spin has one, and 21, 22 and 21 in
/// space.
fn packed_low(dimension: Dimension, parts: IVec3) -> LowBits {
    let [x, y, z] = parts.to_array().map(|part| part as u32);
    match dimension {
        Dimension::Plane => LowBits([x & 0x3f_ffff, y & 0x3f_ffff]),
        Dimension::Space => LowBits([(x & 0x1f_ffff) | (y << 21), ((y >> 11) & 0x7ff) | (z << 11)]),
    }
}

fn unpacked_low(dimension: Dimension, LowBits([a, b]): LowBits) -> IVec3 {
    match dimension {
        Dimension::Plane => IVec3::new((a << 10) as i32 >> 10, (b << 10) as i32 >> 10, 0),
        Dimension::Space => {
            let y = (a >> 21) | (b << 11);
            IVec3::new((a << 11) as i32 >> 11, (y << 10) as i32 >> 10, b as i32 >> 11)
        }
    }
}

/// The unit in the last place of the largest component of a vector as a device has it, which computes in `unit`.
fn last_place(largest: f64, unit: f64) -> f64 {
    let exponent = ((largest / unit) as f32).to_bits() & 0x7f80_0000;
    unit * f64::from(f32::from_bits(exponent.max(50 << 23) - (23 << 23)))
}

/// (a + a_low) (b + b_low) of lengths a, m, and numbers b: a product, and in single precision what it leaves out.
#[inline(always)]
pub fn product_of(s: &State, [a, a_low]: [f64; 2], [b, b_low]: [f64; 2]) -> (f64, f64) {
    match s.model.precision {
        Precision::Double => (a * b, 0.0),
        Precision::Single => {
            let product = (a + a_low) * (b + b_low);
            let place = last_place(product, s.units.of(Quantity::Length));
            let whole = place * (product / place).round_ties_even();
            (whole, product - whole)
        }
    }
}

/// The 12 leading bits of a number, as [`product_of`] wants factors in single precision, and what they leave out.
pub fn leading(precision: Precision, x: f64) -> [f64; 2] {
    if precision == Precision::Double || x == 0.0 {
        return [x, 0.0];
    }
    let place = 2.0_f64.powi(x.abs().log2().floor() as i32 - 11);
    let whole = place * (x / place).round();
    [whole, x - whole]
}

/// A vector in single precision: a number of f32 and what it leaves out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Split {
    pub value: DVec3,
    pub low: LowBits,
}

/// v + low part + step, split anew.
#[inline(always)]
fn rounded_sum(s: &State, quantity: Quantity, v: DVec3, low: DVec3, step: DVec3) -> (DVec3, DVec3) {
    let unit = s.units.of(quantity);
    let place = last_place(largest(v + step).max(2.0_f64.powi(-20) * largest(v)), unit);
    let rounded = |x: DVec3| DVec3::from_array((x / place).to_array().map(f64::round_ties_even)) * place;
    let whole = rounded(v);
    let rest = ((v - whole) + low) + step;
    let more = rounded(rest);
    (whole + more, rest - more)
}

/// What a vector has beyond f32, in its unit.
pub fn low_of(s: &State, quantity: Quantity, v: DVec3, low: LowBits) -> DVec3 {
    let parts = unpacked_low(s.model.dimension, low).as_dvec3();
    parts * (last_place(largest(v), s.units.of(quantity)) / low_parts(s.model.dimension))
}

fn split_sum(s: &State, quantity: Quantity, v: DVec3, low: LowBits, step: DVec3) -> Split {
    let (value, rest) = rounded_sum(s, quantity, v, low_of(s, quantity, v, low), step);
    let parts = low_parts(s.model.dimension);
    let count = rest / last_place(largest(value), s.units.of(quantity)) * parts;
    let most = DVec3::splat(parts);
    let count = count.clamp(-most, most).to_array().map(|x| x.round_ties_even() as i32);
    Split { value, low: packed_low(s.model.dimension, IVec3::from_array(count)) }
}

/// v + low part + step, split anew: into the velocity that all but this function know, and what is left of changes too
/// small for its digits.
#[inline(always)]
pub fn accelerated(s: &State, v: DVec3, low: LowBits, step: DVec3) -> Split {
    match s.model.precision {
        Precision::Double => Split { value: v + step, low },
        Precision::Single => split_sum(s, Quantity::Velocity, v, low, step),
    }
}

/// The same for a spin.
#[inline(always)]
pub fn accelerated_spin(s: &State, w: DVec3, low: LowBits, step: DVec3) -> Split {
    match (s.model.precision, s.model.dimension) {
        (Precision::Double, _) => Split { value: w + step, low },
        (Precision::Single, Dimension::Space) => split_sum(s, Quantity::Rate, w, low, step),
        (Precision::Single, Dimension::Plane) => {
            // A device has one component.
            let along_x = split_sum(s, Quantity::Rate, DVec3::X * w.z, low, DVec3::X * step.z);
            Split { value: DVec3::Z * along_x.value.x, ..along_x }
        }
    }
}

/// What a spin has beyond f32, rad/s.
pub fn spin_low_of(s: &State, w: DVec3, low: LowBits) -> DVec3 {
    match s.model.dimension {
        Dimension::Space => low_of(s, Quantity::Rate, w, low),
        Dimension::Plane => DVec3::Z * low_of(s, Quantity::Rate, DVec3::X * w.z, low).x,
    }
}

/// Rounds that look for the change of a spin end when they move it by less than this part of it, see `has_settled`.
pub fn spin_tolerance(s: &State) -> f64 {
    match s.model.precision {
        Precision::Double => 1e-12,
        Precision::Single => 1e-6,
    }
}
