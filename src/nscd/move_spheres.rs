//! Twin of `shaders/nscd/move_spheres.wgsl`: the end of a step of contact dynamics, positions n to n + 1 with the
//! velocities n + 1.

use crate::{
    contact::history::set_active,
    nscd::contact::list_entries,
    space::{
        boundary::wrap,
        dimension::outside,
        precision::{displaced, position_low_of},
    },
    state::{Position, PositionLow, State, Velocity},
};
use glam::DVec3;

pub fn move_spheres(s: &mut State) {
    s.counters[0].steps_done += 1;
    for i in 0..s.sizes.bodies {
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            set_active(&mut s.neighbour[entry], s.impulse[entry].0 != DVec3::ZERO);
        }
        let (here, low, v) = (s.position[i], position_low_of(s, i), s.pass_velocity[i].v);
        let point = wrap(s, displaced(s, here.x, low.x, s.params.dt * v));
        s.position_next[i] = Position { x: point.x, radius: here.radius };
        if let Some(next) = s.position_low_next.get_mut(i) {
            *next = PositionLow { x: point.low, radius: low.radius };
        }
        s.velocity_next[i] = Velocity { v, inverse_mass: s.velocity[i].inverse_mass };
        if let Some(next) = s.spin_next.get_mut(i) {
            *next = s.pass_spin[i];
        }
        let stride = s.params.dt * v.length();
        s.displacement[i] += stride;
        let lost = outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        if lost || !(s.displacement[i] <= s.params.displacement_limit) {
            s.halt[0] = 1; // the host will take the step back, and walls must not have moved
        }
        if lost {
            s.counters[0].lost_body = s.counters[0].lost_body.max(s.params.bodies - s.id[i]);
        }
    }
}
