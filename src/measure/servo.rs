//! Twin of `shaders/measure/servo.wgsl`: the servo of the cell, which brings the stress of the contacts to a target.

use super::measure_for_servo::is_due;
use crate::{
    space::dimension::{spin_squared, volume_of},
    state::{PartialSums, Spin, State},
};
use glam::DVec3;

/// Against divisions by 0.
const LEAST: f64 = 1.0 / (1_u128 << 100) as f64;

pub fn servo(s: &mut State) {
    if !is_due(s) {
        return;
    }
    let mut sum = PartialSums::default();
    s.partial_sums.iter().for_each(|row| sum.add(row));
    let p = &s.params;
    let cell = &mut s.cell[0];
    let volume = volume_of(s.model.dimension, cell.length);
    let (stress, stress_above) = (-sum.virial / volume, -sum.virial_above.0 / volume);
    let viscosity = p.servo_time * sum.stiffness / (s.model.dims() as f64 * volume);
    let rate =
        |missing: DVec3| -missing / DVec3::splat(viscosity).max(missing.abs() / p.most_rate + DVec3::splat(LEAST));
    let set = |controlled: DVec3, now: DVec3, servo: DVec3| DVec3::select(controlled.cmpgt(DVec3::ZERO), servo, now);
    cell.rate = set(p.controlled, cell.rate, rate(p.stress - stress));
    cell.shear_rate = Spin(set(p.controlled_above.0, cell.shear_rate.0, rate(p.stress_above.0 - stress_above)));
    cell.largest_rate = (cell.rate.length_squared() + spin_squared(cell.shear_rate.0)).sqrt();
    (cell.stress, cell.stress_above) = (stress, Spin(stress_above));
}
