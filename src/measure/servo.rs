//! Twin of `shaders/measure/servo.wgsl`: the servo of the cell, which brings the stress of the contacts to a target.

use super::measure_for_servo::is_due;
use crate::{
    space::dimension::{spin_squared, volume_of},
    state::{PartialSums, Spin, State},
};
use glam::DVec3;

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
    // Modulus times time: never so little that rates leave the range of numbers.
    let dims = s.model.dims() as f64;
    let rigidity = (p.servo_time * sum.stiffness / (dims * (dims + 2.0) * volume)).max(p.least_rigidity);
    let missing = p.controlled * (p.stress - stress);
    let count = p.controlled.element_sum();
    let mean = missing.dot(p.controlled) / count.max(1.0);
    let rate = -(DVec3::splat(mean / (count + 2.0)) + 0.5 * (missing - DVec3::splat(mean))) / rigidity;
    let shear_rate = (stress_above - p.stress_above.0) / rigidity;
    let most = DVec3::splat(p.most_rate);
    let set = |controlled: DVec3, now: DVec3, servo: DVec3| {
        DVec3::select(controlled.cmpgt(DVec3::ZERO), servo.clamp(-most, most), now)
    };
    cell.rate = set(p.controlled, cell.rate, rate);
    cell.shear_rate = Spin(set(p.controlled_above.0, cell.shear_rate.0, shear_rate));
    cell.largest_rate = (cell.rate.length_squared() + spin_squared(cell.shear_rate.0)).sqrt();
    (cell.stress, cell.stress_above) = (stress, Spin(stress_above));
}
