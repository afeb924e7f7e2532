//! Stress, by the virial of contact forces (Love 1927; Weber 1966) and by momentum that moves. Pressure is positive:
//! `V σ_ab = - Σ f_a l_b + Σ m v'_a v'_b`, where `f` acts on a particle at the end of the arm `l` from its centre, and
//! `v'` is its velocity beyond the mean. A contact of two free particles has the branch vector from centre to centre for
//! both arms together; one with a wall or a fixed grain ends at the contact point.

use super::packing::{Packing, outer, rows};
use glam::{DMat3, DVec3};
use serde::Serialize;

/// Pa (in two dimensions N/m); component `[a][b]` is the force along a on what faces b.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stress {
    pub contact: [[f64; 3]; 3],
    pub kinetic: [[f64; 3]; 3],
    /// Their sum.
    pub total: [[f64; 3]; 3],
    /// A third (half, in two dimensions) of the trace.
    pub pressure: f64,
    /// √(3/2 s:s) with the symmetric deviator s; in two dimensions half the difference of the principal stresses.
    pub deviator: f64,
}

impl Stress {
    /// Of sums over a volume.
    pub fn new(dims: usize, volume: f64, contact: DMat3, kinetic: DMat3) -> Stress {
        let (contact, kinetic) = (contact * (1.0 / volume), kinetic * (1.0 / volume));
        let total = contact + kinetic;
        let trace: f64 = (0..dims).map(|k| total.col(k)[k]).sum();
        let pressure = trace / dims as f64;
        let symmetric = (total + total.transpose()) * 0.5;
        let component = |a: usize, b: usize| symmetric.col(b)[a] - if a == b { pressure } else { 0.0 };
        let squares: f64 =
            (0..dims).flat_map(|a| (0..dims).map(move |b| (a, b))).map(|(a, b)| component(a, b).powi(2)).sum();
        let deviator = (if dims == 2 { 0.5 } else { 1.5 } * squares).sqrt();
        Stress { contact: rows(contact), kinetic: rows(kinetic), total: rows(total), pressure, deviator }
    }
}

/// Mean velocity by mass of the free particles, m/s.
pub fn mean_velocity(packing: &Packing) -> DVec3 {
    let (mut momentum, mut mass) = (DVec3::ZERO, 0.0);
    for particle in packing.free() {
        momentum += packing.mass(particle) * packing.velocity(particle);
        mass += packing.mass(particle);
    }
    if mass > 0.0 { momentum / mass } else { DVec3::ZERO }
}

/// Sum over all contacts, J: `V σ` of the contact part.
pub fn virial(packing: &Packing) -> DMat3 {
    packing.totals.virial()
}

/// Of all free particles, over this volume.
pub fn stress(packing: &Packing, volume: f64) -> Stress {
    let mean = mean_velocity(packing);
    let kinetic = packing.free().map(|particle| {
        let v = packing.velocity(particle) - mean;
        outer(packing.mass(particle) * v, v)
    });
    let kinetic = kinetic.fold(DMat3::ZERO, |sum, part| sum + part);
    Stress::new(packing.dims(), volume, virial(packing), kinetic)
}

/// Inside of every particle, over its own volume: the contact part; nothing in fixed ones.
pub fn stress_of_particles(packing: &Packing) -> Vec<[[f64; 3]; 3]> {
    let mut sums = vec![DMat3::ZERO; packing.particles()];
    packing.all_actions().for_each(|action| sums[action.particle] -= outer(action.force, action.arm));
    sums.into_iter().enumerate().map(|(particle, sum)| rows(sum * (1.0 / packing.volume(particle)))).collect()
}
