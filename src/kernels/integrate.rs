//! Twin of `shaders/integrate.wgsl`: leapfrog with global damping, n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).

use crate::{
    laws::{
        boundary::{separation, wrap},
        dimension::outside,
        rotation::integrate_spin,
    },
    model::Rotation,
    state::{Motion, Place, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn integrate(s: &mut State) {
    let (mut place, mut motion) = (std::mem::take(&mut s.place), std::mem::take(&mut s.motion));
    let mut spin = std::mem::take(&mut s.spin);
    if s.model.rotation == Rotation::Sphere {
        spin.par_iter_mut().enumerate().for_each(|(i, spin)| {
            spin.0 = integrate_spin(s, spin.0, s.torque[i].0, &place[i], motion[i].inverse_mass);
        });
    }
    let (bad, broken) = place
        .par_iter_mut()
        .zip(&mut motion)
        .enumerate()
        .map(|(i, (place, motion))| {
            advance(s, place, motion, s.force[i]);
            let gone = outside(place.x, s.params.lower, s.params.upper);
            let moved = separation(s, s.place_before[i].x, place.x).length_squared();
            let bad = if gone { (s.sizes.bodies - i) as u32 } else { 0 };
            (bad, u32::from(!(moved <= s.params.drift_limit * s.params.drift_limit)))
        })
        .reduce(|| (0, 0), |a, b| (a.0.max(b.0), a.1.max(b.1)));
    (s.place, s.motion, s.spin) = (place, motion, spin);
    let counters = &mut s.counters[0];
    counters.bad_body = counters.bad_body.max(bad);
    counters.broken = counters.broken.max(broken);
}

fn advance(s: &State, place: &mut Place, motion: &mut Motion, force: DVec3) {
    let p = &s.params;
    if motion.inverse_mass != 0.0 {
        let half = 0.5 * p.dt * p.damping;
        motion.v = ((1.0 - half) * motion.v + p.dt * (motion.inverse_mass * force + p.gravity)) / (1.0 + half);
    }
    place.x = wrap(s, place.x + p.dt * motion.v);
}
