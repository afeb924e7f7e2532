//! Overlaps of the pairs in the lists, and what rounding may do to the forces that follow from them.

use super::{
    geometry::{branch_vector, sphere_separation},
    materials::pair_of,
    normal::normal_force,
    state::ContactState,
};
use crate::{
    space::{precision::position_low_of, walls::wall_separation},
    state::{INDEX, NONE, State},
};

/// Two surfaces.
pub struct Overlap {
    /// Over the sum of radii, > 0 where they touch.
    pub relative: f64,
    /// Of the normal spring, N.
    pub force: f64,
}

/// How two surfaces lie to each other.
pub struct Gap {
    /// The other one: a body, or a wall beyond these.
    pub other: usize,
    /// m, < 0 where they overlap.
    pub gap: f64,
    /// m, of the other one; None of a wall.
    radius: Option<f64>,
}

/// Those of grain i and its neighbours.
pub fn gaps(s: &State, i: usize) -> impl Iterator<Item = Gap> {
    let bodies = s.sizes.bodies;
    let here = &s.position[i];
    let entries = s.row(i).map_while(|entry| s.neighbour.get(entry)).take_while(|entry| **entry != NONE);
    entries.map(|entry| (entry & INDEX) as usize).filter(move |j| *j < bodies + s.sizes.walls).map(move |other| {
        let Some(there) = s.position.get(other) else {
            let gap = wall_separation(&s.wall[other - bodies], here, position_low_of(s, i)).gap;
            return Gap { other, gap, radius: None };
        };
        let rest = position_low_of(s, i).radius + position_low_of(s, other).radius;
        let gap = sphere_separation(branch_vector(s, i, other), here.radius, there.radius, rest).gap;
        Gap { other, gap, radius: Some(there.radius) }
    })
}

impl Gap {
    /// The overlap over the smaller radius, of a grain of this one.
    pub fn over_smaller(&self, radius: f64) -> f64 {
        -self.gap / radius.min(self.radius.unwrap_or(f64::INFINITY))
    }
}

/// Those of grain i with its neighbours.
pub fn overlaps(s: &State, i: usize) -> impl Iterator<Item = Overlap> {
    let here = s.position[i].radius;
    gaps(s, i).map(move |Gap { other, gap, radius }| {
        let (size, radius) = radius.map_or((here, here), |there| (here + there, here * there / (here + there)));
        let c = ContactState { gap: gap.min(0.0), radius, ..ContactState::default() };
        Overlap { relative: -gap / size, force: normal_force(s.model.normal, &pair_of(s, i, other), &c) }
    })
}

/// The deepest, over the sum of radii.
pub fn deepest(s: &State) -> f64 {
    (0..s.sizes.bodies).flat_map(|i| overlaps(s, i)).map(|o| o.relative).fold(0.0, f64::max)
}

/// The largest, N. What a contact makes inherits the rounding of its normal force, however small it is itself: at rest,
/// forces of many times a grain's weight balance to it.
pub fn largest_force(s: &State) -> f64 {
    (0..s.sizes.bodies).flat_map(|i| overlaps(s, i)).map(|o| o.force).fold(0.0, f64::max)
}

/// N m
pub fn largest_torque(s: &State) -> f64 {
    largest_force(s) * s.position.iter().map(|p| p.radius).fold(0.0, f64::max)
}
