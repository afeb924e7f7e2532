//! Twin of `shaders/measure/wall_loads_for_servo.wgsl`: what `wall_loads` does, before every so many steps, for the walls
//! that a servo moves.

use super::{
    measure_for_servo::is_due,
    wall_sums::{Of, sum},
};
use crate::state::State;

pub fn wall_loads_for_servo(s: &mut State) {
    if is_due(s) {
        sum(s, Of::Driven);
    }
}
