//! Twin of `shaders/measure/measure.wgsl`: sums over free grains at step n, in an order that no
//! sorting changes.

use crate::{
    body::{Body, ForceTorque, bodies::body},
    contact::contacts::closed_contacts,
    contact::law::forgotten_energy,
    measure::{contacts::contact_of, energies::energies, sums::Energies},
    model::Method,
    state::{ACTIVE, INDEX, NONE, PARTIAL_SUMS, PartialSums, State},
};
use rayon::prelude::*;

pub fn measure(s: &mut State) {
    let mut partial_sums = std::mem::take(&mut s.partial_sums);
    partial_sums.par_iter_mut().enumerate().for_each(|(p, partial_sums)| {
        *partial_sums = PartialSums::default();
        let numbers = (p..s.sizes.bodies).step_by(PARTIAL_SUMS);
        numbers.for_each(|number| add_body(s, s.index_of_id[number] as usize, partial_sums));
    });
    s.partial_sums = partial_sums;
}

fn add_body(s: &State, i: usize, sum: &mut PartialSums) {
    let p = &s.params;
    let here = body(s, i);
    if here.velocity.inverse_mass == 0.0 {
        return;
    }
    let (mut gathered, mut drag) = (ForceTorque::default(), ForceTorque::default());
    for (j, contact) in closed_contacts(s, i, &here, contact_of) {
        let smaller = here.position.radius.min(s.position.get(j).map_or(f64::INFINITY, |there| there.radius));
        let single = is_single(s, j);
        let share = share(single);
        gathered.add(&contact);
        drag.force += contact.damping;
        drag.torque += contact.couple_damping;
        sum.elastic += share * contact.energy;
        sum.contact_force += share * (contact.force - contact.damping).length();
        sum.dissipation += share * contact.dissipation;
        sum.overlap = sum.overlap.max(-contact.gap / smaller);
        sum.sides += 1;
        sum.single_sides += u32::from(single);
    }
    sum.dissipation += forgotten(s, i, &here) / p.dt;
    add_energies(sum, &energies(s, &here, &gathered, &drag));
}

/// What a grain has by itself.
pub fn add_energies(sum: &mut PartialSums, own: &Energies) {
    sum.kinetic += own.kinetic;
    sum.potential += own.potential;
    sum.net_force += own.net_force;
    sum.dissipation += own.dissipation;
}

/// Whether only one side of a contact with neighbour j is measured.
fn is_single(s: &State, j: usize) -> bool {
    s.velocity.get(j).is_none_or(|there| there.inverse_mass == 0.0)
}

/// What one side counts for.
fn share(single: bool) -> f64 {
    if single { 1.0 } else { 0.5 }
}

/// Energy that contacts which have opened since the last step still remember, which the next one forgets, J.
fn forgotten(s: &State, i: usize, here: &Body) -> f64 {
    if s.model.method == Method::ContactDynamics {
        return 0.0; // rigid grains store nothing
    }
    let active =
        s.row(i).take_while(|&entry| s.neighbour[entry] != NONE).filter(|&entry| s.neighbour[entry] & ACTIVE != 0);
    let energy = |entry: usize| {
        let j = (s.neighbour[entry] & INDEX) as usize;
        let contact = contact_of(s, i, here, j, entry);
        if contact.is_active { 0.0 } else { share(is_single(s, j)) * forgotten_energy(s, i, here, j, entry) }
    };
    active.map(energy).sum()
}
