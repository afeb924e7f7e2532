//! Twin of `shaders/friction/`. The spring of a slot is passed in, because the kernel's grain owns it.

use crate::{
    model::Friction,
    state::{Pair, State},
};
use glam::DVec3;

/// Tangential force on the grain of interest, N: the old spring turned into the new contact plane by the smallest
/// rotation Z from `n_before` to `n` (2.11), stretched by the slip of this step (2.8), (2.9), capped (2.13).
pub fn tangential_force(
    s: &State,
    spring: Option<&mut DVec3>,
    pair: &Pair,
    n: DVec3,
    n_before: DVec3,
    v_rel: DVec3,
    pressing: f64,
) -> DVec3 {
    let Some(spring) = spring else { return DVec3::ZERO };
    let old = *spring;
    let turned = old - n.dot(old) / (1.0 + n.dot(n_before)).max(1e-6) * (n_before + n);
    let slip = s.params.dt * (v_rel - v_rel.dot(n) * n);
    let mut f = turned - pair.tangential_stiffness * slip;
    let limit = pair.friction * pressing.max(-pressing);
    let length_squared = f.length_squared();
    if length_squared > limit * limit {
        f *= limit / length_squared.sqrt();
    }
    *spring = f;
    f
}

/// The contact is open.
pub fn forget_spring(spring: Option<&mut DVec3>) {
    if let Some(spring) = spring {
        *spring = DVec3::ZERO;
    }
}

/// The spring that (i, j) had in the old lists (sorted by id), N; zero if there was none.
pub fn inherit_spring(s: &State, i: usize, j: u32) -> DVec3 {
    let slots = s.slot_start_before[i] as usize..s.slot_start_before[i + 1] as usize;
    match s.neighbour_before[slots.clone()].binary_search(&j) {
        Ok(k) => s.spring_before[slots.start + k],
        Err(_) => DVec3::ZERO,
    }
}

/// Springs of grain i in the old lists.
pub fn springs_before(s: &State, i: usize) -> u32 {
    let slots = s.slot_start_before[i] as usize..s.slot_start_before[i + 1] as usize;
    s.spring_before[slots].iter().filter(|f| **f != DVec3::ZERO).count() as u32
}

/// The spring in a slot, N; zero where the model has none.
pub fn spring_of(s: &State, slot: usize) -> DVec3 {
    match s.model.friction {
        Friction::None => DVec3::ZERO,
        Friction::Coulomb => s.spring[slot],
    }
}

/// Energy stored in the spring, J.
pub fn tangential_energy(s: &State, slot: usize, pair: &Pair) -> f64 {
    let f = spring_of(s, slot);
    if pair.tangential_stiffness == 0.0 {
        return 0.0;
    }
    0.5 * f.length_squared() / pair.tangential_stiffness
}

/// Length of the spring force, N.
pub fn tangential_length(s: &State, slot: usize) -> f64 {
    spring_of(s, slot).length()
}
