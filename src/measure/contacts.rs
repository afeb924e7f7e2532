//! What the method of a scene makes of its contacts and velocities at step n.

use crate::{
    body::{
        Body, ForceTorque,
        grains::Clump,
        rotation::{sphere_spin_change, spin_change_to_step},
    },
    contact::law::{self, Contact},
    dem::{leapfrog::velocity_change_to_step, predictor_corrector::clump_spin_change_now},
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

/// Changes of velocity, m/s, and spin, rad/s, of a grain to the time of its position.
#[inline(always)]
pub fn velocity_change_now(s: &State, here: &Body, sum: &ForceTorque) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => {
            let spin_change = sphere_spin_change(s, here, sum.torque, spin_change_to_step);
            (velocity_change_to_step(s, &here.velocity, sum.force), spin_change)
        }
        Method::ContactDynamics => (DVec3::ZERO, DVec3::ZERO),
    }
}

/// The same of a clump; its spin in the axes in which it spins.
pub fn clump_velocity_change_now(s: &State, c: usize, here: &Clump, sum: &ForceTorque) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => {
            let spin_change = clump_spin_change_now(s, c, here, sum.torque);
            (velocity_change_to_step(s, &here.velocity, sum.force), spin_change)
        }
        Method::ContactDynamics => (DVec3::ZERO, DVec3::ZERO),
    }
}
