//! Twin of `shaders/contact.wgsl` and `shaders/bodies.wgsl`: one contact, seen from one of its two sides.

use super::{
    boundary::between,
    dashpot::dashpot_force,
    dimension::moment,
    friction::{slid_spring, sliding_power, spring_of, stretched_spring},
    materials::pair_of,
    normal::normal_force,
    precision::{Point, residue_of},
    rotation::{spin_of, surface_velocity},
    touch::{touch_grain, unit_or, within},
    walls::{touch_wall, wall_normal_before, wall_velocity},
};
use crate::state::{INDEX, Motion, NONE, Place, Residue, State};
use glam::DVec3;

/// All there is to know of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Body {
    pub place: Place,
    pub residue: Residue,
    pub motion: Motion,
    /// rad/s
    pub spin: DVec3,
}

/// Grain i.
#[inline(always)]
pub fn body(s: &State, i: usize) -> Body {
    Body { place: s.place[i], residue: residue_of(s, i), motion: s.motion[i], spin: spin_of(s, i) }
}

/// What acts on one side of a contact.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    /// m; >= 0: no contact, and nothing below means anything.
    pub gap: f64,
    /// N, on the grain of interest.
    pub force: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// N, the tangential part of the force.
    pub spring: DVec3,
    /// N, what the dashpot presses, part of the force.
    pub damping: f64,
    /// W, of dashpot and sliding.
    pub dissipation: f64,
}

/// Whether the neighbour may touch: an answer without residues, for the price of one place.
#[inline(always)]
pub fn near(s: &State, here: &Place, j: usize) -> bool {
    s.place.get(j).is_none_or(|there| within(s, here, there, 0.0))
}

/// The contact of grain i with neighbour j, whose spring was `old`. (On a device both grains compute it from the same
/// side, so that the results are opposite to the last bit; here they are anyway, because f64 in Rust is not reordered.)
#[inline(always)]
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, old: DVec3) -> Contact {
    let bodies = s.sizes.bodies;
    let mut contact = Contact::default();
    let mut way = Point::default();
    let touch = if j < bodies {
        let there = &s.place[j];
        way = between(s, here.place.x, there.x, residue_of(s, j).x - here.residue.x);
        touch_grain(s, i, j, way, here.place.radius, there.radius, here.residue.radius + residue_of(s, j).radius)
    } else {
        touch_wall(&s.wall[j - bodies], &here.place, here.residue)
    };
    contact.gap = touch.gap;
    if touch.gap < 0.0 {
        let n = touch.n;
        let arm = (here.place.radius + 0.5 * touch.gap) * n; // erratum E7: one shared point, mid-overlap
        let mut inverse_mass = here.motion.inverse_mass;
        let (v_rel, n_before) = if j < bodies {
            let (there, other) = (&s.place[j], &s.motion[j]);
            let v = here.motion.v - other.v;
            let arm_there = -(there.radius + 0.5 * touch.gap) * n;
            inverse_mass += other.inverse_mass;
            (
                v + (surface_velocity(here.spin, arm) - surface_velocity(spin_of(s, j), arm_there)),
                unit_or((way.x + way.residue) + s.params.since * v, n),
            )
        } else {
            let wall = &s.wall[j - bodies];
            (
                (here.motion.v - wall_velocity(wall, here.place.x + arm)) + surface_velocity(here.spin, arm),
                wall_normal_before(s, wall, here.place.x - s.params.since * here.motion.v),
            )
        };
        let pair = pair_of(s, i, j);
        let approach = v_rel.dot(n);
        let damping = dashpot_force(s.model.dashpot, &pair, approach, inverse_mass);
        let pressing = normal_force(&pair, touch.gap) + damping;
        let stretched = stretched_spring(s, old, &pair, n, n_before, v_rel);
        contact.spring = slid_spring(stretched, &pair, pressing);
        contact.force = contact.spring - pressing * n;
        contact.arm = arm;
        contact.damping = damping;
        contact.dissipation = damping * approach + sliding_power(s, old, stretched, contact.spring, &pair);
    }
    contact
}

/// Force, N, and moment, N m, of all contacts of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    pub force: DVec3,
    pub torque: DVec3,
}

impl Gathered {
    pub fn add(&mut self, contact: &Contact) {
        self.force += contact.force;
        self.torque += moment(contact.arm, contact.force);
    }
}

/// The closed contacts of grain i with the other's index, in ascending order of its number. The springs stay as they are.
pub fn closed_contacts<'a>(s: &'a State, i: usize, here: &'a Body) -> impl Iterator<Item = (usize, Contact)> + 'a {
    let slots = s.row(i).take_while(|&slot| s.neighbour[slot] != NONE);
    let contacts = slots.map(move |slot| {
        let entry = s.neighbour[slot];
        let j = (entry & INDEX) as usize;
        (j, contact_of(s, i, here, j, spring_of(entry, s.spring.get(slot))))
    });
    contacts.filter(|(_, contact)| contact.gap < 0.0)
}

/// All contacts of grain i.
pub fn contacts_of(s: &State, i: usize, here: &Body) -> Gathered {
    let mut sum = Gathered::default();
    closed_contacts(s, i, here).for_each(|(_, contact)| sum.add(&contact));
    sum
}
