//! Twin of `shaders/friction/`. Entries and springs of a grain's slots are passed in, because the kernel's grain owns them.

use super::contact::Law;
use crate::{
    model::Friction,
    state::{INDEX, NONE, Packed, Pair, SPRUNG, State},
};
use glam::DVec3;

/// The spring of a slot, N.
#[inline(always)]
pub fn spring_of(entry: u32, spring: Option<&Packed>) -> DVec3 {
    match spring {
        Some(spring) if entry & SPRUNG != 0 => spring.0,
        _ => DVec3::ZERO,
    }
}

/// The same, flagged or not.
#[inline(always)]
pub fn kept_spring(spring: &Packed) -> DVec3 {
    spring.0
}

/// The contact in this slot has this spring now.
#[inline(always)]
pub fn keep_spring(spring: &mut Packed, f: DVec3) {
    spring.0 = f;
}

/// Whether the contact in this slot is closed, so that the spring counts.
#[inline(always)]
pub fn flag(entry: &mut u32, closed: bool) {
    *entry = *entry & INDEX | if closed { SPRUNG } else { 0 };
}

/// The old spring turned into the new contact plane by the smallest rotation Z from `n_before` to `n` (2.11) and
/// stretched by the slip of this step (2.8), (2.9), N.
#[inline(always)]
pub fn stretched_spring(law: Law, old: DVec3, pair: &Pair, n: DVec3, n_before: DVec3, v_rel: DVec3) -> DVec3 {
    if law.friction == Friction::None {
        return DVec3::ZERO;
    }
    let turned = old - n.dot(old) / (1.0 + n.dot(n_before)).max(1e-6) * (n_before + n);
    let slip = law.since * (v_rel - v_rel.dot(n) * n);
    turned - pair.tangential_stiffness * slip
}

/// Capped by sliding (2.13), N.
#[inline(always)]
pub fn slid_spring(stretched: DVec3, pair: &Pair, pressing: f64) -> DVec3 {
    let limit = pair.friction * pressing.abs();
    let length_squared = stretched.length_squared();
    let scale = limit / length_squared.sqrt();
    stretched * if length_squared > limit * limit { scale } else { 1.0 }
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
#[inline(always)]
pub fn sliding_power(law: Law, old: DVec3, stretched: DVec3, slid: DVec3, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 || law.since == 0.0 {
        return 0.0;
    }
    (0.5 * (old + slid)).dot(stretched - slid) / (pair.tangential_stiffness * law.since)
}

/// Energy stored in a spring, J.
pub fn spring_energy(f: DVec3, pair: &Pair) -> f64 {
    if pair.tangential_stiffness == 0.0 { 0.0 } else { 0.5 * f.length_squared() / pair.tangential_stiffness }
}

/// Slots whose springs grain i hands to the history: those it shares with a grain of larger index, or a wall.
pub fn springs_kept(s: &State, i: usize) -> impl Iterator<Item = usize> {
    let kept = move |entry: u32| entry != NONE && entry & SPRUNG != 0 && (entry & INDEX) as usize > i;
    s.row(i).filter(move |&slot| kept(s.neighbour[slot]))
}

/// The spring of grain i and neighbour j in the history, N, and whether it is this grain's to count.
pub fn inherit_spring(s: &State, i: usize, j: u32) -> Option<(DVec3, bool)> {
    let mine = s.sorted[i];
    let (owner, other) = match s.sorted.get(j as usize) {
        Some(&theirs) => (mine.min(theirs), mine.max(theirs)),
        None => (mine, j),
    };
    let mut kept = s.history_start[owner as usize]..s.history_start[owner as usize + 1];
    let at = kept.find(|&at| s.history_other[at as usize] == other)?;
    let f = s.history_spring[at as usize].0;
    Some(if owner == mine { (f, true) } else { (-f, false) })
}
