//! Arrays that are compared by a rule of their own, whatever stage writes them.

use crate::{
    contact::kicks::{kicks_of_bodies, kicks_of_clumps},
    measure::contacts::contact_of,
    space::precision::{low_of, spin_low_of},
    state::{Array, Cell, Counters, State, VelocityLow, array::*},
    units::Quantity,
};
use glam::DVec3;

/// How an array is compared, if not number by number.
pub enum Rule {
    /// A value and all that single precision leaves out of it together, over a scale in their unit. In double precision the
    /// value stands alone, and is compared as any.
    Parts { value: &'static Array, low: &'static [&'static Array], scale: fn(&State) -> f64 },
    /// Velocity and spin of a row with what single precision leaves out of them, over scales in their units.
    Velocities { of: fn(&State, usize) -> [DVec3; 2], scales: fn(&State) -> [f64; 2] },
    /// Twin and device, in numbers that are relative already.
    Records(fn(&State, &State) -> f64),
}

/// The rules, with the arrays that they are for.
static RULES: &[(&[&Array], Rule)] = &[
    (
        &[&POSITION_LOW_NEXT, &POSITION_NEXT],
        Rule::Parts { value: &POSITION_NEXT, low: &[&POSITION_LOW_NEXT], scale: displacement_of_a_body },
    ),
    (
        &[&CENTER_LOW_NEXT, &CENTER_NEXT],
        Rule::Parts { value: &CENTER_NEXT, low: &[&CENTER_LOW_NEXT], scale: displacement_of_a_clump },
    ),
    (
        &[&ORIENTATION_REST_NEXT, &ORIENTATION_LOW_NEXT, &ORIENTATION_NEXT],
        Rule::Parts {
            value: &ORIENTATION_NEXT,
            low: &[&ORIENTATION_LOW_NEXT, &ORIENTATION_REST_NEXT],
            scale: rotation_of_a_clump,
        },
    ),
    (&[&VELOCITY_LOW_NEXT], Rule::Velocities { of: velocities_of_a_body, scales: |s| kicks_of_bodies(s, contact_of) }),
    (
        &[&CLUMP_VELOCITY_LOW_NEXT],
        Rule::Velocities { of: velocities_of_a_clump, scales: |s| kicks_of_clumps(s, contact_of) },
    ),
    (&[&COUNTERS], Rule::Records(counters)),
    (&[&ROTATION_ITERATIONS], Rule::Records(rotation_iterations)),
    (&[&CELL_NEXT], Rule::Records(cell)),
];

/// The rule of an array, if it has one.
pub fn rule(array: &Array) -> Option<&'static Rule> {
    RULES.iter().find(|(arrays, _)| arrays.contains(&array)).map(|(_, rule)| rule)
}

/// The largest of this step, m, which is what must not be lost.
fn displacement_of_a_body(s: &State) -> f64 {
    let displacement = s.velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * s.params.dt;
    // Members of clumps are put at the ends of arms, anew in every step, with 34 bits of the longest of these.
    let arm = s.member_offset.iter().map(|arm| arm.0.length()).fold(0.0, f64::max);
    // And radii that change are a product with 35 bits.
    let largest = s.position.iter().map(|here| here.radius).fold(0.0, f64::max);
    let product = if s.growth_rate.is_empty() { 0.0 } else { largest };
    displacement
        .max(arm.max(product) * 2f64.powi(-15))
        .max(s.params.quantum / 64.0)
        .max(kicks_of_bodies(s, contact_of)[0] * s.params.dt)
}

/// The same for centres of clumps.
fn displacement_of_a_clump(s: &State) -> f64 {
    let fastest = s.clump_velocity_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max);
    (fastest * s.params.dt).max(s.params.quantum / 64.0)
}

/// The same for quaternions.
fn rotation_of_a_clump(s: &State) -> f64 {
    let fastest = s.clump_spin_next.iter().map(|w| w.0.abs().max_element()).fold(0.0, f64::max);
    // At rest, some units in the last place of the low parts are what their lengths are corrected by.
    (0.5 * fastest * s.params.dt).max(2f64.powi(-16))
}

/// What is compared of `velocity_low_next`.
fn velocities_of_a_body(s: &State, i: usize) -> [DVec3; 2] {
    with_low(s, s.velocity_next[i].v, s.spin_next.get(i).map_or(DVec3::ZERO, |spin| spin.0), s.velocity_low_next[i])
}

/// And of `clump_velocity_low_next`.
fn velocities_of_a_clump(s: &State, c: usize) -> [DVec3; 2] {
    with_low(s, s.clump_velocity_next[c].v, s.clump_spin_next[c].0, s.clump_velocity_low_next[c])
}

fn with_low(s: &State, v: DVec3, w: DVec3, low: VelocityLow) -> [DVec3; 2] {
    [v + low_of(s, Quantity::Velocity, v, low.v), w + spin_low_of(s, w, low.spin)]
}

/// Flags must agree; the displacement is a number behind its bits.
fn counters(twin: &State, device: &State) -> f64 {
    let (twin, device) = (twin.counters[0], device.counters[0]);
    let Counters { max_displacement, max_coordinate, .. } = twin;
    if twin != (Counters { max_displacement, max_coordinate, ..device }) {
        return 1.0;
    }
    let difference = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|bits| f64::from(f32::from_bits(bits)));
        if a == b { 0.0 } else { (a - b).abs() / a.max(b) }
    };
    difference(max_displacement, device.max_displacement).max(difference(max_coordinate, device.max_coordinate))
}

/// Rounding may make a round more or less.
fn rotation_iterations(twin: &State, device: &State) -> f64 {
    let (a, b) = (twin.rotation_iterations[0], device.rotation_iterations[0]);
    f64::from(u8::from(a.most.abs_diff(b.most) > 1 || a.capped != b.capped))
}

/// Edges with all that single precision leaves out of them, over what a step does to them: rounding decides which quantum an
/// edge is, and its low part with it. All else by its largest component.
fn cell(twin: &State, device: &State) -> f64 {
    let (a, b) = (&twin.cell_next[0], &device.cell_next[0]);
    let largest = |v: DVec3| v.abs().max_element();
    let (p, length) = (&twin.params, largest(a.length));
    let step = (p.dt * a.largest_rate * length).max(p.quantum);
    let flat = twin.model.dims() == 2;
    let (vector, spin) = if flat { (DVec3::new(1.0, 1.0, 0.0), DVec3::Z) } else { (DVec3::ONE, DVec3::ONE) };
    let over = |a: DVec3, b: DVec3, scale: f64| if a == b { 0.0 } else { largest(a - b) / scale };
    let relative = |a: DVec3, b: DVec3, floor: f64| over(a, b, largest(a).max(largest(b)).max(floor));
    let own = |of: DVec3, a: DVec3, b: DVec3, floor: f64| relative(of * a, of * b, floor);
    let scalar = |a: f64, b: f64| relative(DVec3::splat(a), DVec3::splat(b), 0.0);
    let edges = |cell: &Cell| (vector * (cell.length + cell.length_low), spin * (cell.tilt.0 + cell.tilt_low.0));
    let differences = [
        over(edges(a).0, edges(b).0, step),
        over(edges(a).1, edges(b).1, step),
        own(spin, a.turned_back.0, b.turned_back.0, 0.0),
        own(vector, a.stretch, b.stretch, 0.0),
        own(spin, a.stretch_tilt.0, b.stretch_tilt.0, step / length),
        own(vector, a.rate, b.rate, 0.0),
        own(spin, a.shear_rate.0, b.shear_rate.0, 0.0),
        own(vector, a.rate_next, b.rate_next, 0.0),
        own(spin, a.shear_rate_next.0, b.shear_rate_next.0, 0.0),
        own(vector, a.steady_rate, b.steady_rate, 0.0),
        own(spin, a.steady_shear_rate.0, b.steady_shear_rate.0, 0.0),
        own(vector, a.stress, b.stress, 0.0),
        own(spin, a.stress_above.0, b.stress_above.0, 0.0),
        scalar(a.settled, b.settled),
        scalar(a.largest_rate, b.largest_rate),
    ];
    differences.into_iter().fold(0.0, |a: f64, b| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) })
}
