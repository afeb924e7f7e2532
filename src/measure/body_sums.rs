//! Twin of `shaders/measure/body_sums.wgsl`: what a body adds to the sums over grains.

use crate::{
    body::{
        Body, ForceTorque,
        bodies::body,
        rotation::{spin_of, surface_velocity},
    },
    contact::{
        geometry::near,
        history::history_of,
        law::{Contact, forgotten_energy},
    },
    measure::{contacts::contact_of, energies::energies, sums::Energies},
    model::Method,
    space::{
        dimension::{moment, spin_dot},
        walls::{relative_to_wall, wall_velocity},
    },
    state::{ACTIVE, INDEX, NONE, PartialSums, State, Works},
};
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
            sums.add(s, &here, j, &contact);
        } else if was_active && !rigid {
            sums.add_opened(s, j, forgotten_energy(s, i, &here, j, history_of(s, entry)));
        }
    }
    *sum = sums.of_body(s, &here);
}

/// What contacts add up to for a free body.
#[derive(Clone, Copy, Debug, Default)]
pub struct BodySums {
    pub contacts: ForceTorque,
    pub dashpots: ForceTorque,
    pub sum: PartialSums,
}

impl BodySums {
    /// An active contact with neighbour j.
    pub fn add(&mut self, s: &State, here: &Body, j: usize, contact: &Contact) {
        let single = is_single(s, j);
        let (share, sum) = (share(single), &mut self.sum);
        self.contacts.add(contact);
        self.dashpots.force += contact.damping;
        self.dashpots.torque += contact.couple_damping;
        sum.elastic += share * contact.energy;
        sum.contact_force += share * (contact.force - contact.damping).length();
        sum.dissipation += share * (contact.dashpot + contact.sliding);
        sum.sliding += share * contact.sliding;
        sum.overlap = sum.overlap.max(relative_overlap(s, here, j, contact));
        sum.sides += 1;
        sum.single_sides += u32::from(single);
        if let Some(w) = j.checked_sub(s.sizes.bodies) {
            sum.wall_power += wall_power(s, here, w, contact);
        } else if single {
            sum.fixed_power += fixed_power(s, here, j, contact);
        }
    }

    /// A contact with neighbour j that has opened since the last step, where it remembers something, whose energy, J, the
    /// next step forgets.
    pub fn add_opened(&mut self, s: &State, j: usize, forgotten: f64) {
        let power = share(is_single(s, j)) * forgotten / s.params.dt;
        self.sum.dissipation += power;
        self.sum.sliding += power;
    }

    /// All that a free body has.
    pub fn of_body(mut self, s: &State, here: &Body) -> PartialSums {
        add_energies(&mut self.sum, &energies(s, here, &self.contacts, &self.dashpots));
        self.sum
    }
}

/// Whether only one of two in contact is a free body, if the other is j.
fn is_single(s: &State, j: usize) -> bool {
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
    }
}

/// What a grain has by itself.
pub fn add_energies(sum: &mut PartialSums, own: &Energies) {
    sum.kinetic += own.kinetic;
    sum.potential += own.potential;
    sum.net_force += own.net_force;
    sum.dissipation += own.dissipation;
}

/// The couple of rolling resistance of a contact, N m.
fn couple(contact: &Contact) -> glam::DVec3 {
    contact.torque - moment(contact.arm, contact.force)
}

/// Work that wall w does on a grain through this contact, per time, W.
fn wall_power(s: &State, here: &Body, w: usize, contact: &Contact) -> f64 {
    let wall = &s.wall[w];
    let v = wall_velocity(wall, here.position.x + contact.arm);
    contact.force.dot(v) + spin_dot(couple(contact), here.spin - relative_to_wall(here.spin, wall))
}

/// The same of fixed grain j.
pub fn fixed_power(s: &State, here: &Body, j: usize, contact: &Contact) -> f64 {
    let (spin, half) = (spin_of(s, j), 0.5 * contact.gap);
    let arm = -contact.arm * ((s.position[j].radius + half) / (here.position.radius + half));
    contact.force.dot(s.velocity[j].v + surface_velocity(spin, arm)) + spin_dot(couple(contact), spin)
}

/// What a step of this length, s, adds to the works since the host has read them.
pub fn add_to_works(works: &mut Works, dt: f64, dissipation: f64, wall_power: f64, fixed_power: f64) {
    works.dissipated += dt * dissipation;
    works.walls += dt * wall_power;
    works.fixed += dt * fixed_power;
}
