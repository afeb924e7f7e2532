//! Twin of `shaders/nscd/move_spheres.wgsl`: the end of a step of contact dynamics, positions n to n + 1 with the
//! velocities n + 1.

use crate::{
    body::bodies::NextPositions,
    contact::history::set_active,
    nscd::contact::list_entries,
    space::{
        boundary::wrap,
        precision::{displaced, position_low_of},
    },
    state::{State, Velocity},
};
use glam::DVec3;
use std::mem::take;

pub fn move_spheres(s: &mut State) {
    s.counters[0].steps_done += 1;
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let mut displacement = take(&mut s.displacement);
    let mut next = NextPositions { position: &mut position, low: &mut low, displacement: &mut displacement };
    for i in 0..s.sizes.bodies {
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            set_active(&mut s.neighbour[entry], s.impulse[entry].0 != DVec3::ZERO);
        }
        let v = s.pass_velocity[i].v;
        s.velocity_next[i] = Velocity { v, inverse_mass: s.velocity[i].inverse_mass };
        if let Some(next) = s.spin_next.get_mut(i) {
            *next = s.pass_spin[i];
        }
        let point = wrap(s, displaced(s, s.position[i].x, position_low_of(s, i).x, s.params.dt * v));
        let limits = next.commit_position(s, (i, i), point, s.params.dt * v.length(), false);
        if limits.halt {
            s.halt[0] = 1; // the host will take the step back, and walls must not have moved
        }
        s.counters[0].lost_body = s.counters[0].lost_body.max(limits.lost_body);
    }
    (s.position_next, s.position_low_next, s.displacement) = (position, low, displacement);
}
