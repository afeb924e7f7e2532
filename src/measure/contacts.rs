//! What the method of a scene makes of its contacts and velocities at step n.

use crate::{
    body::{Body, ForceTorque, grains::Clump, rotation::sphere_spin_at_step},
    contact::law::{self, Contact},
    dem::{leapfrog::velocity_at_step, predictor_corrector::spin_of_clump_now},
    model::Method,
    nscd,
    state::State,
};
use glam::DVec3;

/// The contact of grain i with neighbour j at an entry of its list.
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, entry: usize) -> Contact {
    match s.model.method {
        Method::DiscreteElements => law::contact_of(s, i, here, j, entry),
        Method::ContactDynamics => nscd::contact::contact_of(s, i, here, j, entry),
    }
}

/// Velocity of a grain at the time of its position, m/s, and its spin then, rad/s.
pub fn velocity_now(s: &State, here: &Body, sum: &ForceTorque) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => {
            (velocity_at_step(s, &here.velocity, sum.force), sphere_spin_at_step(s, here, sum.torque))
        }
        Method::ContactDynamics => (here.velocity.v, here.spin),
    }
}

/// Velocity and, in the axes in which it spins, spin of a clump at step n.
pub fn clump_velocity_now(s: &State, c: usize, here: &Clump, sum: &ForceTorque) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => {
            (velocity_at_step(s, &here.velocity, sum.force), spin_of_clump_now(s, c, here, sum.torque))
        }
        Method::ContactDynamics => (here.velocity.v, here.spin),
    }
}
