//! Twin of `shaders/contact.wgsl`, `shaders/method/dem.wgsl` and `shaders/bodies.wgsl`: one contact, seen from one of its two sides.

use super::{
    Touch,
    boundary::between,
    dashpot::dashpot_force,
    dimension::moment,
    friction::{slid_spring, sliding_power, spring_of, stretched_spring},
    leapfrog::at_step,
    materials::pair_of,
    normal::normal_force,
    precision::residue_of,
    rigid,
    rotation::{spin_at_step, spin_of, surface_velocity},
    touch::{apart, touch_grain, unit_or, within},
    walls::{touch_wall, wall_normal_before, wall_velocity},
};
use crate::{
    model::{Dashpot, Friction, Method},
    state::{INDEX, Motion, NONE, Pair, Place, Residue, State},
};
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
    /// m
    pub gap: f64,
    /// If not, nothing below means anything.
    pub closed: bool,
    /// N, on the grain of interest.
    pub force: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// N, the tangential part of the force.
    pub spring: DVec3,
    /// N, what the dashpot adds to the force.
    pub damping: DVec3,
    /// W, of dashpot and sliding.
    pub dissipation: f64,
}

/// Whether the neighbour may touch: an answer without residues, for the price of one place.
#[inline(always)]
pub fn near(s: &State, here: &Place, j: usize) -> bool {
    s.place.get(j).is_none_or(|there| within(s, here, there, 0.0))
}

/// All that the laws of contact know of the scene; what they know of two surfaces they are told.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    pub dashpot: Dashpot,
    pub friction: Friction,
    /// s, since springs were stretched last.
    pub since: f64,
}

impl Law {
    pub fn of(s: &State) -> Law {
        Law { dashpot: s.model.dashpot, friction: s.model.friction, since: s.params.since }
    }
}

/// What two surfaces in contact do to the one that n points away from, N and W.
pub struct Push {
    pub force: DVec3,
    pub spring: DVec3,
    pub damping: DVec3,
    pub dissipation: f64,
}

#[expect(clippy::too_many_arguments, reason = "the same as on the device")]
#[inline(always)]
pub fn push(
    law: Law,
    pair: &Pair,
    gap: f64,
    n: DVec3,
    n_before: DVec3,
    v_rel: DVec3,
    inverse_mass: f64,
    old: DVec3,
) -> Push {
    let approach = v_rel.dot(n);
    let damping = dashpot_force(law.dashpot, pair, approach, inverse_mass);
    let pressing = normal_force(pair, gap) + damping;
    let stretched = stretched_spring(law, old, pair, n, n_before, v_rel);
    let spring = slid_spring(stretched, pair, pressing);
    let dissipation = damping * approach + sliding_power(law, old, stretched, spring, pair);
    Push { force: spring - pressing * n, spring, damping: -damping * n, dissipation }
}

/// All that the contact of two grains depends on, seen from one of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meeting {
    /// m, to the centre of the other; never zero.
    pub way: DVec3,
    /// m/s, relative to the other.
    pub v: DVec3,
    /// rad/s, its own and the other's.
    pub spin: DVec3,
    pub spin_to: DVec3,
    /// N, the spring a step ago.
    pub old: DVec3,
    /// m, its own and the other's, and what single precision leaves out of both.
    pub radius: f64,
    pub radius_to: f64,
    pub radii_rest: f64,
    /// 1/kg, of both.
    pub inverse_mass: f64,
    pub pair: Pair,
}

/// The way from grain i to grain j, m.
#[inline(always)]
pub fn way_to(s: &State, i: usize, j: usize) -> DVec3 {
    let way = between(s, s.place[i].x, s.place[j].x, residue_of(s, j).x - residue_of(s, i).x);
    apart(s, i, j, way.x + way.residue)
}

/// Grain j seen from grain i.
#[inline(always)]
pub fn meeting(s: &State, i: usize, here: &Body, j: usize, old: DVec3) -> Meeting {
    let there = body(s, j);
    Meeting {
        way: way_to(s, i, j),
        v: here.motion.v - there.motion.v,
        spin: here.spin,
        spin_to: there.spin,
        old,
        radius: here.place.radius,
        radius_to: there.place.radius,
        radii_rest: here.residue.radius + there.residue.radius,
        inverse_mass: here.motion.inverse_mass + there.motion.inverse_mass,
        pair: pair_of(s, i, j),
    }
}

/// The contact of two grains. It has no branches, so that many can be computed at a time. (On a device both grains
/// compute it from the same side, so that the results are opposite to the last bit; here they are anyway, because f64 in
/// Rust is not reordered.)
#[inline(always)]
pub fn grain_contact(law: Law, m: &Meeting) -> Contact {
    let Touch { gap, n } = touch_grain(m.way, m.radius, m.radius_to, m.radii_rest);
    let arm = (m.radius + 0.5 * gap) * n; // erratum E7: one shared point, mid-overlap
    let arm_to = -(m.radius_to + 0.5 * gap) * n;
    let v_rel = m.v + (surface_velocity(m.spin, arm) - surface_velocity(m.spin_to, arm_to));
    let n_before = unit_or(m.way + law.since * m.v, n);
    let p = push(law, &m.pair, gap, n, n_before, v_rel, m.inverse_mass, m.old);
    let closed = gap < 0.0;
    Contact { gap, closed, force: p.force, arm, spring: p.spring, damping: p.damping, dissipation: p.dissipation }
}

/// The contact of grain i with wall w, whose spring was `old`.
#[inline(always)]
pub fn wall_contact(s: &State, i: usize, here: &Body, w: usize, old: DVec3) -> Contact {
    let wall = &s.wall[w];
    let Touch { gap, n } = touch_wall(wall, &here.place, here.residue);
    if !(gap < 0.0) {
        return Contact { gap, ..Contact::default() };
    }
    let arm = (here.place.radius + 0.5 * gap) * n;
    let v_rel = (here.motion.v - wall_velocity(wall, here.place.x + arm)) + surface_velocity(here.spin, arm);
    let n_before = wall_normal_before(s, wall, here.place.x - s.params.since * here.motion.v);
    let pair = pair_of(s, i, s.sizes.bodies + w);
    let p = push(Law::of(s), &pair, gap, n, n_before, v_rel, here.motion.inverse_mass, old);
    let closed = gap < 0.0;
    Contact { gap, closed, force: p.force, arm, spring: p.spring, damping: p.damping, dissipation: p.dissipation }
}

/// The contact of grain i with neighbour j, whose spring was `old`.
#[inline(always)]
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, old: DVec3) -> Contact {
    match j.checked_sub(s.sizes.bodies) {
        _ if s.model.method == Method::ContactDynamics => rigid::contact(s, i, here, j, old),
        None => grain_contact(Law::of(s), &meeting(s, i, here, j, old)),
        Some(w) => wall_contact(s, i, here, w, old),
    }
}

/// Force, N, and moment, N m, of all contacts of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Gathered {
    pub force: DVec3,
    pub torque: DVec3,
}

impl Gathered {
    #[inline(always)]
    pub fn add(&mut self, contact: &Contact) {
        self.force += contact.force;
        self.torque += moment(contact.arm, contact.force);
    }
}

/// The closed contacts of grain i with the other's index, in ascending order of its number. The springs stay as they are.
pub fn closed_contacts<'a>(s: &'a State, i: usize, here: &'a Body) -> impl Iterator<Item = (usize, Contact)> + 'a {
    let slots = s.row(i).take_while(|&slot| s.neighbour[slot] != NONE);
    let entries = slots.map(|slot| (slot, s.neighbour[slot], (s.neighbour[slot] & INDEX) as usize));
    let rigid = s.model.method == Method::ContactDynamics;
    let nearby = entries.filter(move |&(_, _, j)| rigid || near(s, &here.place, j));
    let contacts =
        nearby.map(move |(slot, entry, j)| (j, contact_of(s, i, here, j, spring_of(entry, s.spring.get(slot)))));
    contacts.filter(|(_, contact)| contact.closed)
}

/// All contacts of grain i.
pub fn contacts_of(s: &State, i: usize, here: &Body) -> Gathered {
    let mut sum = Gathered::default();
    closed_contacts(s, i, here).for_each(|(_, contact)| sum.add(&contact));
    sum
}

/// Velocity of a grain at the time of its position, m/s, and its spin then, rad/s.
pub fn motion_now(s: &State, here: &Body, sum: &Gathered) -> (DVec3, DVec3) {
    match s.model.method {
        Method::DiscreteElements => (at_step(s, &here.motion, sum.force), spin_at_step(s, here, sum.torque)),
        Method::ContactDynamics => (here.motion.v, here.spin),
    }
}
