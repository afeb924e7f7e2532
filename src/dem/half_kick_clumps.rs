//! Twin of `shaders/dem/half_kick_clumps.wgsl`: velocities of clumps and their members from time 0 to -1/2.

use crate::{
    body::{
        ForceTorque,
        grains::{Clump, clump, spins_in_scene},
        rotation::spin_change_back,
    },
    contact::{
        contacts::{change_clump_velocities, contacts_of_clump},
        law::contact_of,
    },
    dem::{
        leapfrog::velocity_change_back,
        predictor_corrector::{own_torque, spin_acceleration},
    },
    state::{Spin, State},
};
use glam::DVec3;

pub fn half_kick_clumps(s: &mut State) {
    let change = |s: &State, _, here: &Clump, sum: &ForceTorque| {
        let w = here.spin;
        let mut change = DVec3::ZERO;
        if !spins_in_scene(&s.model, here.inverse_moments) {
            change = spin_change_back(s, w, spin_acceleration(s, here, w, own_torque(here, sum.torque)));
        } else if here.velocity.inverse_mass != 0.0 {
            change = spin_change_back(s, w, here.inverse_moments * sum.torque);
        }
        (velocity_change_back(s, &here.velocity, sum.force), change)
    };
    for c in 0..s.sizes.clumps {
        let here = clump(s, c);
        let (_, spin_change) = change(s, c, &here, &contacts_of_clump(s, c, here.orientation, contact_of));
        s.spin_increment[c] = Spin(-2.0 * spin_change); // the step that the half step back is half of
    }
    change_clump_velocities(s, contact_of, change);
}
