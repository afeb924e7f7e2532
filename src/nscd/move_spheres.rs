//! Twin of `shaders/nscd/move_spheres.wgsl`: the end of a step of contact dynamics, positions n to n + 1 with the
//! velocities n + 1.

use crate::{
    body::{
        ForceTorque,
        bodies::{NextPositions, NextVelocities, body, changed_velocities},
        rotation::inverse_inertia,
    },
    contact::history::set_active,
    nscd::{
        compliance::remember_spring,
        contact::{damping_factor, free_spin_change, free_velocity_change, list_entries},
    },
    space::{
        boundary::{approach, carried, wrap},
        dimension::moment,
        precision::displaced,
    },
    state::{HALTED, State},
};
use glam::DVec3;
use std::mem::take;

pub fn move_spheres(s: &mut State) {
    s.counters[0].steps_done += 1;
    let (mut position, mut low) = (take(&mut s.position_next), take(&mut s.position_low_next));
    let mut displacement = take(&mut s.displacement);
    let mut next = NextPositions { position: &mut position, low: &mut low, displacement: &mut displacement };
    for i in 0..s.sizes.bodies {
        let mut sum = ForceTorque::default();
        for entry in list_entries(s, i).collect::<Vec<_>>() {
            let impulse = s.impulse[entry].0;
            set_active(&mut s.neighbour[entry], impulse != DVec3::ZERO);
            remember_spring(s, entry);
            sum.force += impulse;
            sum.torque += moment(s.inverse_effective_mass[entry].arm * s.contact_geometry[entry].n, impulse);
        }
        let here = body(s, i);
        // From the impulses, and not from the velocities of the last pass, which have no digits for a small change.
        let inverse_mass = damping_factor(s) * here.velocity.inverse_mass;
        let change = free_velocity_change(s, &here.velocity) + inverse_mass * sum.force;
        let inertia = inverse_inertia(s, &here.position, inverse_mass);
        let spin_change = free_spin_change(s, &here.velocity, here.spin) + inertia * sum.torque;
        let changed = changed_velocities(s, i, &here, change, spin_change);
        let v = changed.velocity.v;
        let velocity = &mut s.velocity_next;
        NextVelocities { velocity, spin: &mut s.spin_next, low: &mut s.velocity_low_next }.store(i, changed);
        let step = s.params.dt * carried(s, s.model.boundary, here.position.x, v);
        let point = wrap(s, s.model.boundary, displaced(s, here.position.x, here.low.x, step));
        let stride = approach(s, s.model.boundary, s.params.dt * v.length(), here.position.radius);
        let limits = next.commit_position(s, (i, i), point, stride, false);
        if limits.halt {
            s.halt[0] = HALTED; // the host will take the step back, and walls must not have moved
        }
        s.counters[0].lost_body = s.counters[0].lost_body.max(limits.lost_body);
    }
    (s.position_next, s.position_low_next, s.displacement) = (position, low, displacement);
}
