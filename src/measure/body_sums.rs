//! Twin of `shaders/measure/body_sums.wgsl`: what a body adds to the sums over grains.

use crate::{
    body::{
        Body, ForceTorque,
        bodies::body,
        grains::arm_in_grain,
        rotation::{spin_of, surface_velocity},
    },
    contact::{
        geometry::near,
        growth::{growth_power, growth_power_of_mass, growth_rate_of},
        history::{History, history_of},
        law::{Contact, forgotten_energy, grain_pair},
    },
    measure::{contacts::contact_of, energies::energies, sums::Energies},
    model::{Growth, Method},
    space::{
        dimension::{moment, outer_above, spin_dot},
        turning::{relative_to_wall, wall_velocity},
    },
    state::{ACTIVE, INDEX, NONE, PartialSums, Spin, State, Works},
};
use glam::DVec3;
use rayon::prelude::*;

/// What all bodies have, one after the other as they lie in memory, next to their neighbours.
pub fn sums_of_bodies(s: &State) -> Vec<PartialSums> {
    let of_body = |i| {
        let mut sum = PartialSums::default();
        add_body(s, i, &mut sum);
        sum
    };
    (0..s.sizes.bodies).into_par_iter().with_min_len(64).map(of_body).collect()
}

/// What free body i and its contacts have at step n.
fn add_body(s: &State, i: usize, sum: &mut PartialSums) {
    let here = body(s, i);
    if here.velocity.inverse_mass == 0.0 {
        return;
    }
    let rigid = s.model.method == Method::ContactDynamics; // rigid grains store nothing
    let mut sums = BodySums::default();
    for entry in s.row(i) {
        let tagged = s.neighbour[entry];
        if tagged == NONE {
            break;
        }
        let (j, was_active) = ((tagged & INDEX) as usize, tagged & ACTIVE != 0);
        if !(rigid || was_active || near(s, &here.position, j)) {
            continue;
        }
        let contact = contact_of(s, i, &here, j, entry);
        if contact.is_active {
            sums.add_contact(s, i, &here, j, &contact);
        } else if was_active && !rigid {
            sums.add_opened(s, is_single(s, j), forgotten_energy(s, i, &here, j, history_of(s, entry)));
        }
    }
    *sum = sums.of_body(s, i, &here);
}

/// What contacts add up to for a free body.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(64))]
pub struct BodySums {
    pub contacts: ForceTorque,
    pub dashpots: ForceTorque,
    pub elastic: f64,
    pub contact_force: f64,
    pub dissipation: f64,
    pub sliding: f64,
    pub overlap: f64,
    pub wall_power: f64,
    pub fixed_power: f64,
    pub growth_power: f64,
    pub virial: DVec3,
    pub virial_above: DVec3,
    pub stiffness: f64,
    pub sides: u32,
    pub single_sides: u32,
}

/// How much steeper than a straight line from 0 forces grow with overlaps: that of elastic spheres with the power 3/2.
pub const STEEPEST: f64 = 1.5;

/// What a contact of two grains adds to what a strain of all lengths alike does to the trace of the virial, J.
#[inline(always)]
pub fn stiffness_of(contact: &Contact) -> f64 {
    let work = (contact.damping - contact.force).dot(contact.branch).max(0.0) / -contact.gap;
    // Rigid grains store nothing, and have no stiffness.
    if contact.gap < 0.0 && contact.energy > 0.0 { STEEPEST * work * contact.branch.length() } else { 0.0 }
}

impl BodySums {
    /// Of an active contact with neighbour j.
    fn of(s: &State, i: usize, here: &Body, j: usize, contact: &Contact) -> BodySums {
        let single = is_single(s, j);
        let share = share(single);
        let wall = j.checked_sub(s.sizes.bodies);
        BodySums {
            contacts: ForceTorque { force: contact.force, torque: contact.torque },
            dashpots: ForceTorque { force: contact.damping, torque: contact.couple_damping },
            elastic: share * contact.energy,
            contact_force: share * (contact.force - contact.damping).length(),
            dissipation: share * (contact.dashpot + contact.sliding),
            sliding: share * contact.sliding,
            overlap: relative_overlap(s, here, j, contact),
            wall_power: wall.map_or(0.0, |w| wall_power(s, here, w, contact)),
            fixed_power: if single && wall.is_none() { fixed_power(s, here, j, contact) } else { 0.0 },
            growth_power: match (s.model.growth, wall) {
                (Growth::None, _) => 0.0,
                (Growth::Some, None) => {
                    let pair = grain_pair(s, i, here, j, History::default());
                    share * pair.growth_power(s.model.normal, contact.force)
                }
                (Growth::Some, Some(_)) => {
                    let (rate, radius) = (growth_rate_of(s, i), here.position.radius);
                    let pressing = -contact.force.dot(contact.arm) / (radius + 0.5 * contact.gap);
                    share * growth_power(s.model.normal, pressing, contact.gap, rate * radius, rate)
                }
            },
            virial: share * (contact.force * contact.branch),
            virial_above: share * outer_above(contact.force, contact.branch),
            stiffness: share * stiffness_of(contact),
            sides: 1,
            single_sides: u32::from(single),
        }
    }

    #[inline(always)]
    pub fn add(&mut self, more: &BodySums) {
        self.contacts.force += more.contacts.force;
        self.contacts.torque += more.contacts.torque;
        self.dashpots.force += more.dashpots.force;
        self.dashpots.torque += more.dashpots.torque;
        self.elastic += more.elastic;
        self.contact_force += more.contact_force;
        self.dissipation += more.dissipation;
        self.sliding += more.sliding;
        self.overlap = self.overlap.max(more.overlap);
        self.wall_power += more.wall_power;
        self.fixed_power += more.fixed_power;
        self.growth_power += more.growth_power;
        self.virial += more.virial;
        self.virial_above += more.virial_above;
        self.stiffness += more.stiffness;
        self.sides += more.sides;
        self.single_sides += more.single_sides;
    }

    /// An active contact with neighbour j.
    pub fn add_contact(&mut self, s: &State, i: usize, here: &Body, j: usize, contact: &Contact) {
        self.add(&BodySums::of(s, i, here, j, contact));
    }

    /// A contact that has opened since the last step, where it remembers something, whose energy, J, the next step
    /// forgets; `single` if only one of the two is a free body.
    pub fn add_opened(&mut self, s: &State, single: bool, forgotten: f64) {
        let power = share(single) * forgotten / s.params.dt;
        self.dissipation += power;
        self.sliding += power;
    }

    /// All that a free body has.
    #[inline(always)]
    pub fn of_body(&self, s: &State, i: usize, here: &Body) -> PartialSums {
        let own = energies(s, here, &self.contacts, &self.dashpots);
        // What acts on a member acts on the centre of its clump.
        let (force, arm) = (self.contacts.force, arm_in_grain(s, i));
        let translation = 0.5 * own.flux.element_sum();
        let of_mass = match s.model.growth {
            Growth::None => 0.0,
            Growth::Some => growth_power_of_mass(s, i, translation, own.kinetic - translation, own.potential),
        };
        PartialSums {
            kinetic: own.kinetic,
            potential: own.potential,
            elastic: self.elastic,
            net_force: own.net_force,
            contact_force: self.contact_force,
            dissipation: self.dissipation + own.dissipation,
            sliding: self.sliding,
            wall_power: self.wall_power,
            fixed_power: self.fixed_power,
            growth_power: self.growth_power + of_mass,
            overlap: self.overlap,
            sides: self.sides,
            single_sides: self.single_sides,
            virial: self.virial + force * arm,
            virial_above: Spin(self.virial_above + outer_above(force, arm)),
            flux: own.flux,
            flux_above: Spin(own.flux_above),
            stiffness: self.stiffness,
        }
    }
}

/// Whether only one of two in contact is a free body, if the other is j.
pub fn is_single(s: &State, j: usize) -> bool {
    s.velocity.get(j).is_none_or(|there| there.inverse_mass == 0.0)
}

/// What part of a contact each of its free bodies counts.
pub fn share(single: bool) -> f64 {
    if single { 1.0 } else { 0.5 }
}

/// Over the smaller radius.
fn relative_overlap(s: &State, here: &Body, j: usize, contact: &Contact) -> f64 {
    let other = s.position.get(j).map_or(f64::INFINITY, |there| there.radius);
    -contact.gap / here.position.radius.min(other)
}

impl PartialSums {
    #[inline(always)]
    pub fn add(&mut self, more: &PartialSums) {
        self.kinetic += more.kinetic;
        self.potential += more.potential;
        self.elastic += more.elastic;
        self.dissipation += more.dissipation;
        self.sliding += more.sliding;
        self.net_force += more.net_force;
        self.contact_force += more.contact_force;
        self.overlap = self.overlap.max(more.overlap);
        self.sides += more.sides;
        self.single_sides += more.single_sides;
        self.wall_power += more.wall_power;
        self.fixed_power += more.fixed_power;
        self.growth_power += more.growth_power;
        self.virial += more.virial;
        self.virial_above.0 += more.virial_above.0;
        self.flux += more.flux;
        self.flux_above.0 += more.flux_above.0;
        self.stiffness += more.stiffness;
    }
}

/// What a grain has by itself.
pub fn add_energies(sum: &mut PartialSums, own: &Energies) {
    sum.kinetic += own.kinetic;
    sum.potential += own.potential;
    sum.net_force += own.net_force;
    sum.dissipation += own.dissipation;
    sum.flux += own.flux;
    sum.flux_above.0 += own.flux_above;
}

/// The couple of rolling resistance of a contact, N m.
pub fn couple(contact: &Contact) -> glam::DVec3 {
    contact.torque - moment(contact.arm, contact.force)
}

/// Work that wall w does on a grain through this contact, per time, W.
fn wall_power(s: &State, here: &Body, w: usize, contact: &Contact) -> f64 {
    let wall = &s.wall[w];
    let v = wall_velocity(s, wall, here.position.x + contact.arm);
    contact.force.dot(v) + spin_dot(couple(contact), here.spin - relative_to_wall(s, here.spin, wall))
}

/// The same of fixed grain j.
pub fn fixed_power(s: &State, here: &Body, j: usize, contact: &Contact) -> f64 {
    let (spin, half) = (spin_of(s, j), 0.5 * contact.gap);
    let arm = -contact.arm * ((s.position[j].radius + half) / (here.position.radius + half));
    contact.force.dot(s.velocity[j].v + surface_velocity(spin, arm)) + spin_dot(couple(contact), spin)
}

/// What a step of this length, s, adds to the works since the host has read them, of works per time.
pub fn add_to_works(works: &mut Works, dt: f64, powers: &Works) {
    works.dissipated += dt * powers.dissipated;
    works.walls += dt * powers.walls;
    works.fixed += dt * powers.fixed;
    works.cell += dt * powers.cell;
    works.growth += dt * powers.growth;
}
