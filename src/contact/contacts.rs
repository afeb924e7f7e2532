//! Twin of `shaders/contact/contacts.wgsl`: the contacts of a body, or of a clump, by whatever law its method has.

use super::{geometry::near, law::Contact};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::{NextVelocities, body, changed_velocities},
        grains::{Clump, arm_of, changed_clump_velocities, clump, member_ids, set_clump_velocity},
    },
    model::Method,
    space::dimension::moment,
    state::{INDEX, NONE, State},
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

/// Changes of velocity and spin that follow from the contact forces now, for all grains.
pub fn change_all_velocities(
    s: &mut State,
    of: ContactOf,
    law: impl Fn(&State, &Body, &ForceTorque) -> (DVec3, DVec3) + Sync,
) {
    let of_body = |i| {
        let here = body(s, i);
        let (change, spin_change) = law(s, &here, &contacts_of(s, i, &here, of));
        changed_velocities(s, i, &here, change, spin_change)
    };
    let values: Vec<_> = (0..s.sizes.bodies).into_par_iter().map(of_body).collect();
    let mut next =
        NextVelocities { velocity: &mut s.velocity_next, spin: &mut s.spin_next, low: &mut s.velocity_low_next };
    values.into_iter().enumerate().for_each(|(i, changed)| next.store(i, changed));
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

/// Clumps change their velocities as a law says with the contacts of a clump, and their members get those that belong to
/// them, where they are.
pub fn change_clump_velocities(
    s: &mut State,
    of: ContactOf,
    law: impl Fn(&State, usize, &Clump, &ForceTorque) -> (DVec3, DVec3) + Sync,
) {
    let changed = |c| {
        let here = clump(s, c);
        let (change, spin_change) = law(s, c, &here, &contacts_of_clump(s, c, here.orientation, of));
        changed_clump_velocities(s, c, &here, change, spin_change)
    };
    let all: Vec<_> = (0..s.sizes.clumps).into_par_iter().with_min_len(64).map(changed).collect();
    for (c, changed) in all.into_iter().enumerate() {
        set_clump_velocity(s, c, &clump(s, c), changed);
    }
}
