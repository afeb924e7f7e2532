//! Twin of `shaders/measure.wgsl`: sums over free grains at step n, in a fixed order.

use crate::{
    laws::{
        contact::{Gathered, body, closed_contacts},
        friction::spring_energy,
        leapfrog::at_step,
        materials::pair_of,
        normal::{normal_energy, normal_force},
        rotation::{spin_at_step, spin_energy},
    },
    state::{PARTS, Part, State},
};
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
    let inverse_mass = here.motion.inverse_mass;
    if inverse_mass == 0.0 {
        return;
    }
    let mut gathered = Gathered::default();
    for (j, contact) in closed_contacts(s, i, &here) {
        let other = s.place.get(j).map(|there| (there.radius, s.motion[j].inverse_mass == 0.0));
        let (radius, single) = other.unwrap_or((here.place.radius, true));
        let smaller = here.place.radius.min(radius);
        let share = if single { 1.0 } else { 0.5 };
        let pair = pair_of(s, i, j);
        let normal = normal_force(&pair, contact.gap);
        gathered.add(&contact);
        sum.elastic += share * (normal_energy(&pair, contact.gap) + spring_energy(contact.spring, &pair));
        sum.contact_force += share * (normal * normal + contact.spring.length_squared()).sqrt();
        sum.dissipation += share * contact.dissipation;
        sum.overlap = sum.overlap.max(-contact.gap / smaller);
        sum.sides += 1;
        sum.single_sides += u32::from(single);
    }
    let v = at_step(s, &here.motion, gathered.force);
    let w = spin_at_step(s, &here, gathered.torque);
    let kinetic = 0.5 * v.length_squared() / inverse_mass + spin_energy(s, &here, w);
    let total = gathered.force + p.gravity / inverse_mass;
    sum.kinetic += kinetic;
    sum.potential -= p.gravity.dot(here.place.x + here.residue.x) / inverse_mass;
    sum.net_force += total.length();
    sum.dissipation += 2.0 * p.damping * kinetic;
}
