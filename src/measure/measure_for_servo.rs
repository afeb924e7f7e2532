//! Twin of `shaders/measure/measure_for_servo.wgsl`: what `measure` does, before every so many steps, for the servo of the
//! cell.

use super::measure::measure;
use crate::state::{HALTED, State};

pub fn measure_for_servo(s: &mut State) {
    if is_due(s) {
        measure(s);
    }
}

/// Whether the servo looks before this step. It has done so if the step was taken back, after which springs are those of
/// now.
pub fn is_due(s: &State) -> bool {
    let step = s.params.step.wrapping_add(s.halt[0]);
    let again = s.params.history_dt == 0.0 && step > 0;
    s.halt[0] < HALTED && !again && step.is_multiple_of(s.params.servo_steps)
}
