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
    backbone(&inside, &packing.totals.ends, least_contacts(packing, packing.totals.frictional))
}

impl Coordination {
    pub fn of(packing: &Packing, carrying: &[bool]) -> Coordination {
        let free = packing.free().count();
        let totals = &packing.totals;
        let is_free = |particle: u32| (particle as usize) < packing.particles() && packing.is_free(particle as usize);
        let carries = |particle: u32| carrying.get(particle as usize).is_none_or(|carries| *carries);
        let (mut sides, mut carrying_sides, mut contacts, mut constraints) = (0, 0, 0, 0);
        for (&(a, b), rough) in totals.ends.iter().zip(&totals.rough) {
            let of_contact = usize::from(is_free(a)) + usize::from(is_free(b));
            sides += of_contact;
            if carries(a) && carries(b) {
                contacts += 1;
                carrying_sides += of_contact;
                constraints += if *rough { packing.dims() as i64 } else { 1 };
            }
        }
        let carrying_outside = totals.outside.iter().filter_map(|&(k, normal)| {
            let (a, b) = totals.ends[k as usize];
            (carries(a) && carries(b)).then(|| (normal, totals.rough[k as usize]))
        });
        let outside: Vec<(DVec3, bool)> = carrying_outside.collect();
        let left = packing.free().filter(|particle| carrying[*particle]).count();
        let freedom = degrees_of_freedom(packing) as i64 * left as i64 - trivial_motions(packing, &outside) as i64;
        Coordination {
            contacts: totals.contacts(),
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
    let turns = !packing.clumps.is_empty() || packing.totals.frictional;
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
