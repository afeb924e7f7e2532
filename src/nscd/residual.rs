//! Twin of `shaders/nscd/residual.wgsl`: how far the impulses are from a solution, by the natural map, which anyone can
//! compute again. A step is solved when every contact is, relative to what acts on it: a norm would not see a column
//! that falls beside many grains at rest, or far from a fast one.

use crate::{
    contact::history::set_active,
    nscd::{
        compliance::{compliance_at, compliant},
        contact::{NO_SPEED, list_entries, oriented_contact, store_residual_sums},
        response::natural_map_scale,
    },
    solve::natural_map::{OrientedContact, natural_map},
    state::{ACTIVE, INDEX, ResidualSums, State},
};
use glam::DVec3;
use rayon::prelude::*;

/// More than this part of what acts on a contact is no rounding: loads that nothing balances grow from pass to pass.
const MOST_ROUNDING: f64 = 1e-2;

pub fn residual(s: &mut State) {
    store_residual_sums(s, residual_sums_of);
    let found: Vec<usize> = (0..s.sizes.bodies).into_par_iter().flat_map_iter(|i| late(s, i)).collect();
    found.into_iter().for_each(|entry| set_active(&mut s.neighbour[entry], true));
}

/// Velocity and spin after the last pass.
fn at(s: &State, i: usize) -> (DVec3, DVec3) {
    (s.pass_velocity[i].v, s.pass_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0))
}

/// Entries of pairs that were left out and meet after all: they take part from now on.
fn late(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    list_entries(s, i).filter(move |&entry| is_late(s, entry, &oriented_contact(s, i, entry, |i| at(s, i))))
}

fn is_late(s: &State, entry: usize, side: &OrientedContact) -> bool {
    s.neighbour[entry] & ACTIVE == 0 && side.velocity.dot(side.n) > 0.0
}

fn residual_sums_of(s: &State, i: usize) -> ResidualSums {
    let mut sums = ResidualSums::default();
    for entry in list_entries(s, i) {
        let rigid = oriented_contact(s, i, entry, |i| at(s, i));
        let impulse = rigid.sign * s.impulse[entry].0;
        let compliance = compliance_at(s, i, entry);
        let side = compliant(s, &rigid, &compliance, impulse);
        sums.late_contacts += u32::from(is_late(s, entry, &side));
        let normal_impulse = -impulse.dot(side.n);
        let friction = impulse + normal_impulse * side.n;
        let error = natural_map(&side, impulse, natural_map_scale(s, entry, &side, &compliance));
        // Of its two grains' loads a small part, because sums of loads that balance have no more digits.
        let j = (s.neighbour[entry] & INDEX) as usize;
        let loads = s.load_speed[i] + s.load_speed.get(j).copied().unwrap_or_default();
        let scale = s.contact_geometry[entry].speed + s.params.load_fraction * loads + NO_SPEED;
        let size = error.length();
        sums.largest_residual = sums.largest_residual.max(size / scale);
        let may_be_rounding = size <= MOST_ROUNDING * s.contact_geometry[entry].speed;
        let rounding = if may_be_rounding { s.params.load_rounding * loads } else { 0.0 };
        sums.resolved_residual = sums.resolved_residual.max(size / (scale + rounding));
        sums.reference += side.share * scale * scale;
        sums.residual_squared += side.share * error.length_squared();
        sums.max_normal_impulse = sums.max_normal_impulse.max(normal_impulse);
        sums.coulomb_excess = sums.coulomb_excess.max(friction.length() - side.friction * normal_impulse);
    }
    sums
}
