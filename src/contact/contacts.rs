//! Twin of `shaders/contact/contacts.wgsl`: the contacts of a body, or of a clump, by whatever law its method has.

use super::{geometry::near, law::Contact};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::body,
        grains::{Clump, arm_of, clump, member_ids, set_clump_velocity},
    },
    model::Method,
    space::dimension::moment,
    state::{INDEX, NONE, State, Velocity},
};
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// A law of contact: of grain i with its neighbour j at an entry of its list.
pub type ContactOf = fn(&State, usize, &Body, usize, usize) -> Contact;

impl ForceTorque {
    #[inline(always)]
    pub fn add(&mut self, contact: &Contact) {
        self.force += contact.force;
        self.torque += contact.torque;
    }
}

/// The active contacts of grain i with the other's index, in ascending order of its number. What they remember stays as
/// it is.
pub fn closed_contacts<'a>(
    s: &'a State,
    i: usize,
    here: &'a Body,
    of: ContactOf,
) -> impl Iterator<Item = (usize, Contact)> + 'a {
    let entries = s.row(i).take_while(|&entry| s.neighbour[entry] != NONE);
    let entries = entries.map(|entry| (entry, (s.neighbour[entry] & INDEX) as usize));
    let rigid = s.model.method == Method::ContactDynamics;
    let nearby = entries.filter(move |&(_, j)| rigid || near(s, &here.position, j));
    nearby.map(move |(entry, j)| (j, of(s, i, here, j, entry))).filter(|(_, contact)| contact.is_active)
}

/// All contacts of grain i.
pub fn contacts_of(s: &State, i: usize, here: &Body, of: ContactOf) -> ForceTorque {
    let mut sum = ForceTorque::default();
    closed_contacts(s, i, here, of).for_each(|(_, contact)| sum.add(&contact));
    sum
}

/// Velocities and spins that follow from the contact forces now, for all grains.
pub fn velocities(s: &mut State, of: ContactOf, law: impl Fn(&State, &Body, &ForceTorque) -> (DVec3, DVec3) + Sync) {
    let of_body = |i| {
        let here = body(s, i);
        law(s, &here, &contacts_of(s, i, &here, of))
    };
    let values: Vec<_> = (0..s.sizes.bodies).into_par_iter().map(of_body).collect();
    for (i, (v, spin)) in values.into_iter().enumerate() {
        s.velocity_next[i] = Velocity { v, inverse_mass: s.velocity[i].inverse_mass };
        if let Some(next) = s.spin_next.get_mut(i) {
            next.0 = spin;
        }
    }
}

/// Force and moment, about the clump's centre, of all contacts of all its members. What they remember stays as it is.
pub fn contacts_of_clump(s: &State, c: usize, q: DVec4, of: ContactOf) -> ForceTorque {
    let mut sum = ForceTorque::default();
    for member_id in member_ids(s, c) {
        let i = s.index_of_id[member_id] as usize;
        let member = contacts_of(s, i, &body(s, i), of);
        sum.force += member.force;
        sum.torque += member.torque + moment(arm_of(s, q, member_id), member.force);
    }
    sum
}

/// Clumps and their members have the velocities next, where they are, that a law gives with the contacts of a clump.
pub fn set_clump_velocities(
    s: &mut State,
    of: ContactOf,
    law: impl Fn(&State, usize, &Clump, &ForceTorque) -> (DVec3, DVec3) + Sync,
) {
    let velocity = |c| law(s, c, &clump(s, c), &contacts_of_clump(s, c, clump(s, c).orientation, of));
    let velocities: Vec<(DVec3, DVec3)> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(velocity).collect();
    for (c, (v, w)) in velocities.into_iter().enumerate() {
        set_clump_velocity(s, c, &clump(s, c), v, w);
    }
}
