//! Twin of `shaders/measure.wgsl`: sums over free grains at step n, in a fixed order.

use crate::{
    laws::{
        contact::{Body, Gathered, body, closed_contacts, contact_of},
        friction::{spring_energy, spring_of},
        grains::{Energies, energies},
        materials::pair_of,
        normal::normal_energy,
    },
    state::{INDEX, NONE, PARTS, Part, SPRUNG, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn measure(s: &mut State) {
    let mut part = std::mem::take(&mut s.part);
    part.par_iter_mut().enumerate().for_each(|(p, part)| {
        *part = Part::default();
        (p..s.sizes.bodies).step_by(PARTS).for_each(|i| add_body(s, i, part));
    });
    s.part = part;
}

fn add_body(s: &State, i: usize, sum: &mut Part) {
    let p = &s.params;
    let here = body(s, i);
    if here.motion.inverse_mass == 0.0 {
        return;
    }
    let (mut gathered, mut drag) = (Gathered::default(), DVec3::ZERO);
    for (j, contact) in closed_contacts(s, i, &here) {
        let smaller = here.place.radius.min(s.place.get(j).map_or(f64::INFINITY, |there| there.radius));
        let single = is_single(s, j);
        let share = share(single);
        let pair = pair_of(s, i, j);
        gathered.add(&contact);
        drag += contact.damping;
        sum.elastic += share * (normal_energy(&pair, contact.gap) + spring_energy(contact.spring, &pair));
        sum.contact_force += share * (contact.force - contact.damping).length();
        sum.dissipation += share * contact.dissipation;
        sum.overlap = sum.overlap.max(-contact.gap / smaller);
        sum.sides += 1;
        sum.single_sides += u32::from(single);
    }
    sum.dissipation += forgotten(s, i, &here) / p.dt;
    add_energies(sum, &energies(s, &here, &gathered, drag));
}

/// What a grain has by itself.
pub fn add_energies(sum: &mut Part, own: &Energies) {
    sum.kinetic += own.kinetic;
    sum.potential += own.potential;
    sum.net_force += own.net_force;
    sum.dissipation += own.dissipation;
}

/// Whether only one side of a contact with neighbour j is measured.
fn is_single(s: &State, j: usize) -> bool {
    s.motion.get(j).is_none_or(|there| there.inverse_mass == 0.0)
}

/// What one side counts for.
fn share(single: bool) -> f64 {
    if single { 1.0 } else { 0.5 }
}

/// Energy of the springs of contacts that have opened since the last step, which the next one forgets, J.
fn forgotten(s: &State, i: usize, here: &Body) -> f64 {
    let sprung = s.row(i).map(|slot| (slot, s.neighbour[slot])).take_while(|(_, entry)| *entry != NONE);
    let sprung = sprung.filter(|(_, entry)| entry & SPRUNG != 0);
    let energy = |(slot, entry): (usize, u32)| {
        let j = (entry & INDEX) as usize;
        let old = spring_of(entry, s.spring.get(slot));
        let open = !contact_of(s, i, here, j, old).closed;
        if open { share(is_single(s, j)) * spring_energy(old, &pair_of(s, i, j)) } else { 0.0 }
    };
    sprung.map(energy).sum()
}
