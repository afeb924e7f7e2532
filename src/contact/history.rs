//! Twin of `shaders/contact/tangential/`: what contacts remember, and how it is kept when lists are made anew. Entries and history of a
//! grain's list are passed in, because the kernel's grain owns them.

use crate::state::{ACTIVE, INDEX, NONE, Packed, State};
use glam::DVec3;

/// The spring of a slot, N.
#[inline(always)]
pub fn spring_of(tagged: u32, spring: Option<&Packed>) -> DVec3 {
    match spring {
        Some(spring) if tagged & ACTIVE != 0 => spring.0,
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
pub fn set_active(tagged: &mut u32, closed: bool) {
    *tagged = *tagged & INDEX | if closed { ACTIVE } else { 0 };
}

/// Slots whose springs grain i hands to the history: those it shares with a grain of larger index, or a wall.
pub fn active_contacts(s: &State, i: usize) -> impl Iterator<Item = usize> {
    let kept = move |tagged: u32| tagged != NONE && tagged & ACTIVE != 0 && (tagged & INDEX) as usize > i;
    s.row(i).filter(move |&entry| kept(s.neighbour[entry]))
}

/// The spring of grain i and neighbour j in the history, N, and whether it is this grain's to count.
pub fn restore_history(s: &State, i: usize, j: u32) -> Option<(DVec3, bool)> {
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
