//! Twin of `shaders/measure/servo.wgsl`: the servo of the cell, which brings the stress of the contacts to a target.

use super::measure_for_servo::is_due;
use crate::{
    space::dimension::{spin_squared, volume_of},
    state::{PartialSums, Spin, State},
};
use glam::DVec3;

/// By how much less is asked for while motion has the energy of the contacts, a part of the band.
const HELD_BACK: f64 = 0.2;

/// How fast it settles: in twice the time in which steady rates come to what they have to be.
const SETTLING: f64 = 0.5;

/// The root of the energy of motion over that in contacts, at most 50.
fn restlessness(kinetic: f64, elastic: f64) -> f64 {
    const MOST: f64 = 50.0;
    if kinetic < MOST * MOST * elastic { (kinetic / elastic).sqrt() } else { MOST }
}

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
    let uneven = p.controlled * (missing - DVec3::splat(mean));
    let missing_above = stress_above - p.stress_above.0;
    let is_close = |missing: DVec3| missing.abs().max_element() < p.servo_band;
    if is_close(missing) && is_close(p.controlled_above.0 * missing_above) {
        // What begins close to its targets is there.
        let begins = p.step.wrapping_add(s.halt[0]) == 0;
        cell.settled = if begins { 1.0 } else { (cell.settled + SETTLING * p.servo_recall).min(1.0) };
    }
    let held_back = HELD_BACK * p.servo_band * restlessness(sum.kinetic, sum.elastic);
    let lead = mean + (1.0 - cell.settled) * (uneven.min_element() - held_back);
    let step = -(DVec3::splat(lead / (count + 2.0)) + uneven) / rigidity;
    let shear_step = missing_above / rigidity;
    let most = DVec3::splat(p.most_rate);
    let recall = cell.settled * p.servo_recall;
    // A rate at its limit says nothing of what the other components do to the stress.
    let set = |controlled: DVec3, now: &mut DVec3, steady: &mut DVec3, step: DVec3| {
        let controlled = controlled.cmpgt(DVec3::ZERO);
        let rate = (*steady + step).clamp(-most, most);
        *steady += DVec3::select(controlled & rate.abs().cmplt(most), recall * step, DVec3::ZERO);
        *now = DVec3::select(controlled, rate, *now);
    };
    set(p.controlled, &mut cell.rate_next, &mut cell.steady_rate, step);
    set(p.controlled_above.0, &mut cell.shear_rate_next.0, &mut cell.steady_shear_rate.0, shear_step);
    cell.largest_rate = (cell.rate_next.length_squared() + spin_squared(cell.shear_rate_next.0)).sqrt();
    (cell.stress, cell.stress_above) = (stress, Spin(stress_above));
}
