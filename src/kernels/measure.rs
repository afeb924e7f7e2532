//! Twin of `shaders/measure.wgsl`: sums over free grains at step n, in a fixed order.

use crate::{
    laws::{
        friction::{tangential_energy, tangential_length},
        materials::pair_of,
        normal::{normal_energy, normal_force},
        precision::residue_of,
        rotation::spin_energy,
        touch::touch_grain,
        walls::touch_wall,
    },
    state::{NONE, PARTS, Part, State},
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
    let bodies = s.sizes.bodies;
    let p = &s.params;
    let here = &s.place[i];
    let inverse_mass = s.motion[i].inverse_mass;
    if inverse_mass == 0.0 {
        return;
    }
    let total = s.force[i] + p.gravity / inverse_mass;
    let v = (s.motion[i].v + 0.5 * p.dt * inverse_mass * total) / (1.0 + 0.5 * p.dt * p.damping);
    sum.kinetic += 0.5 * v.length_squared() / inverse_mass + spin_energy(s, i, here, inverse_mass);
    sum.potential -= p.gravity.dot(here.x) / inverse_mass;
    sum.net_force += total.length();
    let residue_here = residue_of(s, i);
    for slot in s.slot_start[i] as usize..s.slot_start[i + 1] as usize {
        if s.neighbour[slot] == NONE {
            break;
        }
        let j = s.neighbour[slot] as usize;
        let (touch, smaller, single) = if j < bodies {
            let fixed = s.motion[j].inverse_mass == 0.0;
            (
                touch_grain(s, i, j, here, &s.place[j], residue_of(s, j) - residue_here),
                here.radius.min(s.place[j].radius),
                fixed,
            )
        } else {
            (touch_wall(&s.wall[j - bodies], here.x, residue_here, here.radius), here.radius, true)
        };
        if !(touch.gap < 0.0) {
            continue;
        }
        let share = if single { 1.0 } else { 0.5 };
        let pair = pair_of(s, i, j);
        let normal = normal_force(&pair, touch.gap);
        let tangential = tangential_length(s, slot);
        sum.elastic += share * (normal_energy(&pair, touch.gap) + tangential_energy(s, slot, &pair));
        sum.contact_force += share * (normal * normal + tangential * tangential).sqrt();
        sum.overlap = sum.overlap.max(-touch.gap / smaller);
        sum.sides += 1;
        sum.single_sides += u32::from(single);
    }
}
