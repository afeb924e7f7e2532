//! Twin of `shaders/integrate.wgsl`: leapfrog with global damping, n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).

use crate::{
    laws::{boundary::separation, dimension::outside, precision::displace, rotation::integrate_spin},
    model::Rotation,
    state::{Motion, Place, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn integrate(s: &mut State) {
    let (mut place, mut motion) = (std::mem::take(&mut s.place), std::mem::take(&mut s.motion));
    let mut spin = std::mem::take(&mut s.spin);
    let mut residue = std::mem::take(&mut s.residue);
    if s.model.rotation == Rotation::Sphere {
        spin.par_iter_mut().enumerate().for_each(|(i, spin)| {
            spin.0 = integrate_spin(s, spin.0, s.torque[i].0, &place[i], motion[i].inverse_mass);
        });
    }
    let (bad, broken) = place
        .par_iter_mut()
        .zip(&mut motion)
        .zip(optional(&mut residue, s.sizes.bodies))
        .enumerate()
        .map(|(i, ((place, motion), residue))| {
            advance(s, place, motion, residue, s.force[i]);
            let gone = outside(place.x, s.params.lower, s.params.upper);
            let moved = separation(s, s.place_before[i].x, place.x).length_squared();
            let bad = if gone { (s.sizes.bodies - i) as u32 } else { 0 };
            (bad, u32::from(!(moved <= s.params.drift_limit * s.params.drift_limit)))
        })
        .reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    (s.place, s.motion, s.spin, s.residue) = (place, motion, spin, residue);
    let counters = &mut s.counters[0];
    counters.bad_body = counters.bad_body.max(bad);
    counters.broken = counters.broken.max(broken);
}

fn advance(s: &State, place: &mut Place, motion: &mut Motion, residue: Option<&mut DVec3>, force: DVec3) {
    let p = &s.params;
    if motion.inverse_mass != 0.0 {
        let half = 0.5 * p.dt * p.damping;
        motion.v = ((1.0 - half) * motion.v + p.dt * (motion.inverse_mass * force + p.gravity)) / (1.0 + half);
    }
    place.x = displace(s, place.x, residue, p.dt * motion.v);
}

/// One entry per grain of an array that a model may not have.
fn optional(array: &mut [DVec3], bodies: usize) -> Vec<Option<&mut DVec3>> {
    let mut entries: Vec<Option<&mut DVec3>> = array.iter_mut().map(Some).collect();
    entries.resize_with(bodies, || None);
    entries
}
