//! How many contacts particles have, which of them carry, and which way contacts point.

use super::{
    contact::Other,
    packing::{Packing, outer, rows},
};
use crate::measure::analysis::backbone;
use glam::{DMat3, DVec3};
use serde::Serialize;

/// Contacts of free particles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Coordination {
    pub contacts: usize,
    /// Mean number of contacts of a free particle.
    pub coordination_number: f64,
    /// The same of those that are no rattlers, with each other, walls and fixed grains; None if all are.
    pub coordination_without_rattlers: Option<f64>,
    /// Free particles with fewer contacts than hold them, found one after the other.
    pub rattlers: usize,
    /// Contacts of the others.
    pub contacts_without_rattlers: usize,
    /// What these contacts constrain, less what the others could do: 0 where the packing is isostatic. A contact without
    /// friction, or at its Coulomb limit, constrains one velocity, another as many as there are axes.
    pub isostatic_excess: i64,
}

/// Fewest contacts that hold a particle: one more than axes without friction, two with it; weight stands for one.
fn least_contacts(packing: &Packing, frictional: bool) -> usize {
    let held = if frictional { 2 } else { packing.dims() + 1 };
    held - usize::from(packing.assembly.gravity != DVec3::ZERO)
}

/// Which particles carry; fixed ones do.
pub fn carrying(packing: &Packing) -> Vec<bool> {
    let inside: Vec<bool> = (0..packing.particles()).map(|particle| packing.is_free(particle)).collect();
    let pairs: Vec<(u32, u32)> = packing.contacts.iter().map(|c| ends(packing, c.grain, c.other)).collect();
    let frictional = packing.contacts.iter().any(|contact| contact.friction > 0.0);
    backbone(&inside, &pairs, least_contacts(packing, frictional))
}

/// The particles of a contact; walls come after all of them.
fn ends(packing: &Packing, grain: u32, other: Other) -> (u32, u32) {
    let other = match other {
        Other::Grain(other) => packing.particle_of(other),
        Other::Wall(wall) => packing.particles() + wall as usize,
    };
    (packing.particle_of(grain) as u32, other as u32)
}

impl Coordination {
    pub fn of(packing: &Packing, carrying: &[bool]) -> Coordination {
        let free = packing.free().count();
        let (mut sides, mut carrying_sides, mut contacts, mut constraints) = (0, 0, 0, 0);
        let mut outside = Vec::new();
        for contact in packing.contacts {
            let of_contact = packing.actions(contact).iter().flatten().count();
            sides += of_contact;
            let (a, b) = ends(packing, contact.grain, contact.other);
            let carries = |particle: u32| carrying.get(particle as usize).is_none_or(|carries| *carries);
            if !(carries(a) && carries(b)) {
                continue;
            }
            contacts += 1;
            carrying_sides += of_contact;
            let rough = contact.friction > 0.0 && !contact.sliding;
            constraints += if rough { packing.dims() as i64 } else { 1 };
            if of_contact == 1 {
                outside.push((contact.normal, rough));
            }
        }
        let left = packing.free().filter(|particle| carrying[*particle]).count();
        let freedom = degrees_of_freedom(packing) as i64 * left as i64 - trivial_motions(packing, &outside) as i64;
        Coordination {
            contacts: packing.contacts.len(),
            coordination_number: sides as f64 / free.max(1) as f64,
            coordination_without_rattlers: (left > 0).then(|| carrying_sides as f64 / left as f64),
            rattlers: free - left,
            contacts_without_rattlers: contacts,
            isostatic_excess: if left > 0 { constraints - freedom } else { 0 },
        }
    }
}

/// Of a particle: spheres that nothing turns have translations alone.
fn degrees_of_freedom(packing: &Packing) -> usize {
    let dims = packing.dims();
    let turns = !packing.clumps.is_empty() || packing.contacts.iter().any(|contact| contact.friction > 0.0);
    if !turns { dims } else { dims * (dims + 1) / 2 }
}

/// Motions of all particles together that nothing outside, given by normals and whether there is friction, hinders.
fn trivial_motions(packing: &Packing, outside: &[(DVec3, bool)]) -> usize {
    let dims = packing.dims();
    let held = |axis: usize| outside.iter().any(|(normal, rough)| *rough || normal[axis].abs() > 1e-9);
    let translations = (0..dims).filter(|axis| !held(*axis)).count();
    let alone = outside.is_empty() && !packing.assembly.domain.periodic[..dims].contains(&true);
    translations + if alone { dims * (dims - 1) / 2 } else { 0 }
}

/// Σ n ⊗ n over the contacts of grains with grains, over their number: its trace is 1. None without one.
pub fn fabric(packing: &Packing) -> Option<[[f64; 3]; 3]> {
    let of_grains = packing.contacts.iter().filter(|contact| matches!(contact.other, Other::Grain(_)));
    let (sum, count) =
        of_grains.fold((DMat3::ZERO, 0.0), |(sum, count), c| (sum + outer(c.normal, c.normal), count + 1.0));
    (count > 0.0).then(|| rows(sum * (1.0 / count)))
}
