//! Contacts one by one, from lists and what is remembered there.

use crate::{
    body::{bodies::body, grains::same_grain},
    contact::{geometry::Separation, history::history_of, law::contact_with, materials::pair_of},
    model::Method,
    nscd::contact::{separation_with, warm_start_impulse},
    state::{ACTIVE, INDEX, NONE, State},
};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;

/// The other one of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Other {
    /// A grain of a larger number.
    Grain(u32),
    /// A wall, by its place in [`Assembly::walls`](crate::scene::Assembly::walls).
    Wall(u32),
}

/// A contact of a free grain with another grain or a wall. In a scene with clumps grains are their members. Force and
/// couple are those on `grain`; on the other one they are opposite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// By its place in [`Assembly::grains`](crate::scene::Assembly::grains).
    pub grain: u32,
    pub other: Other,
    /// Unit vector from the grain to the other one.
    pub normal: DVec3,
    /// m, > 0 where the two overlap. Rigid grains that touch may be a little apart.
    pub overlap: f64,
    /// N, all of it, dashpots included.
    pub force: DVec3,
    /// N, how much of the compressive normal force is that of the normal dashpot.
    pub dashpot: f64,
    /// N m, of rolling resistance, dashpot included.
    pub couple: DVec3,
    /// Coefficient of friction.
    pub friction: f64,
    /// Whether friction is at the Coulomb limit.
    pub sliding: bool,
}

impl Contact {
    /// Compressive normal force, N, dashpot included.
    pub fn normal_force(&self) -> f64 {
        -self.force.dot(self.normal)
    }

    /// N
    pub fn tangential_force(&self) -> DVec3 {
        self.force + self.normal_force() * self.normal
    }

    /// Friction over what it may be at most; None without friction or without a force that presses.
    pub fn mobilised_friction(&self) -> Option<f64> {
        let limit = self.friction * self.normal_force().abs();
        (limit > 0.0).then(|| self.tangential_force().length() / limit)
    }
}

/// Friction counts as at its limit within the rounding of double precision.
const ROUNDING: f64 = 1e-12;

/// The contacts of a run of bodies with those of larger number and with walls. `lists` has the entries of their lists,
/// and what contacts remember there, counted from entry number `first` on; `s` has all else.
pub(crate) fn contacts_of(s: &State, bodies: Range<usize>, lists: &State, first: usize) -> Vec<Contact> {
    let of_body = |i: usize| {
        let entries = s.row(i).from(first);
        entries
            .take_while(|entry| lists.neighbour[*entry] != NONE)
            .filter_map(move |entry| contact_at(s, i, lists, entry))
    };
    bodies.into_par_iter().with_min_len(64).flat_map_iter(of_body).collect()
}

/// That at an entry of body i, if it acts and is the body's to count.
fn contact_at(s: &State, i: usize, lists: &State, entry: usize) -> Option<Contact> {
    let tagged = lists.neighbour[entry];
    let (j, was_active) = ((tagged & INDEX) as usize, tagged & ACTIVE != 0);
    let inverse_mass = |i: usize| s.velocity.get(i).map_or(0.0, |v| v.inverse_mass);
    let mine = s.id.get(j).is_none_or(|other| *other > s.id[i]);
    if !mine || inverse_mass(i) + inverse_mass(j) == 0.0 || (j < s.sizes.bodies && same_grain(s, i, j)) {
        return None;
    }
    let (here, friction) = (body(s, i), pair_of(s, i, j).friction);
    let other = s.id.get(j).map_or(Other::Wall((j - s.sizes.bodies) as u32), |id| Other::Grain(*id));
    let contact = |Separation { gap, n }: Separation, force| Contact {
        grain: s.id[i],
        other,
        normal: n,
        overlap: -gap,
        force,
        dashpot: 0.0,
        couple: DVec3::ZERO,
        friction,
        sliding: false,
    };
    let (contact, rounding) = match s.model.method {
        Method::DiscreteElements => {
            let found = contact_with(s, i, &here, j, was_active, history_of(lists, entry));
            if !found.is_active {
                return None;
            }
            let contact = contact(separation_with(s, i, &here, j), found.force);
            let dashpot = -found.damping.dot(contact.normal);
            let couple = found.history.rolling.torque + found.couple_damping;
            (Contact { dashpot, couple, ..contact }, ROUNDING)
        }
        Method::ContactDynamics => {
            let impulse = warm_start_impulse(lists, entry);
            if impulse == DVec3::ZERO {
                return None;
            }
            let force = impulse * (1.0 / s.params.dt);
            // A step is solved to a tolerance, and no further.
            (contact(separation_with(s, i, &here, j), force), s.params.tolerance)
        }
    };
    let sliding = contact.mobilised_friction().is_some_and(|part| part >= 1.0 - rounding);
    Some(Contact { sliding, ..contact })
}
