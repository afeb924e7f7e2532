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
    let step = -(DVec3::splat(mean / (count + 2.0)) + 0.5 * (missing - DVec3::splat(mean))) / rigidity;
    let shear_step = (stress_above - p.stress_above.0) / rigidity;
    let most = DVec3::splat(p.most_rate);
    // It begins where the stress has come close to its target: before, all that is missing would add up. And a rate at its
    // limit says nothing of what the other components do to the stress.
    let set = |controlled: DVec3, missing: DVec3, now: &mut DVec3, steady: &mut DVec3, step: DVec3| {
        let controlled = controlled.cmpgt(DVec3::ZERO);
        let rate = (*steady + step).clamp(-most, most);
        let holds = missing.abs().cmplt(DVec3::splat(p.servo_band)) | steady.cmpne(DVec3::ZERO);
        *steady += DVec3::select(controlled & holds & rate.abs().cmplt(most), p.servo_recall * step, DVec3::ZERO);
        *now = DVec3::select(controlled, rate, *now);
    };
    let missing_above = stress_above - p.stress_above.0;
    set(p.controlled, missing, &mut cell.rate_next, &mut cell.steady_rate, step);
    set(p.controlled_above.0, missing_above, &mut cell.shear_rate_next.0, &mut cell.steady_shear_rate.0, shear_step);
    cell.largest_rate = (cell.rate_next.length_squared() + spin_squared(cell.shear_rate_next.0)).sqrt();
    (cell.stress, cell.stress_above) = (stress, Spin(stress_above));
}
