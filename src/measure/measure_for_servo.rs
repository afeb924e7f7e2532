//! Twin of `shaders/measure/measure_for_servo.wgsl`: what `measure` does, before every so many steps, for the servo of the
//! cell.

use super::measure::measure;
use crate::state::{HALTED, State};

pub fn measure_for_servo(s: &mut State) {
    if is_due(s) {
        measure(s);
    }
}

/// Whether the servo looks before this step.
pub fn is_due(s: &State) -> bool {
    s.halt[0] < HALTED && s.params.step.wrapping_add(s.halt[0]).is_multiple_of(s.params.servo_steps)
}
