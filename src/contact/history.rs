//! Twin of `shaders/contact/history/`: what contacts remember, and how it is kept when lists are made anew.

use super::{rolling::RollingHistory, tangential::TangentialHistory};
use crate::{
    body::blocks::{by_entry, by_entry_of, by_history},
    model::History as Slot,
    state::{ACTIVE, INDEX, NONE, Packed, Spin, State},
};
use glam::DVec3;
use rayon::prelude::*;
use std::mem::take;

/// What a contact remembers, on the grain of interest. What the model does not have stays zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct History {
    pub tangential: TangentialHistory,
    pub rolling: RollingHistory,
}

/// What the contact at an entry remembers, if it is active.
pub fn history_of(s: &State, entry: usize) -> History {
    if s.neighbour[entry] & ACTIVE == 0 {
        return History::default();
    }
    History {
        tangential: TangentialHistory { force: s.tangential_force.get(entry).map_or(DVec3::ZERO, |f| f.0) },
        rolling: RollingHistory { torque: s.rolling_torque.get(entry).map_or(DVec3::ZERO, |t| t.0) },
    }
}

/// The entries of a run of grains: neighbours, and what their contacts remember; empty what the model does not have.
pub struct Lists<'a> {
    /// What marks an active contact: nothing, if contacts remember nothing.
    active: u32,
    pub neighbour: &'a mut [u32],
    pub tangential_force: &'a mut [Packed],
    pub rolling_torque: &'a mut [Spin],
}

impl Lists<'_> {
    /// [`history_of`].
    #[inline(always)]
    pub fn history(&self, entry: usize) -> History {
        let mut history = History::default();
        if self.neighbour[entry] & ACTIVE != 0 {
            history.tangential.force = self.tangential_force.get(entry).map_or(DVec3::ZERO, |f| f.0);
            history.rolling.torque = self.rolling_torque.get(entry).map_or(DVec3::ZERO, |t| t.0);
        }
        history
    }

    #[inline(always)]
    pub fn is_active(&self, entry: usize) -> bool {
        self.neighbour[entry] & ACTIVE != 0
    }

    #[inline(always)]
    pub fn set_history(&mut self, entry: usize, history: &History) {
        if let Some(force) = self.tangential_force.get_mut(entry) {
            force.0 = history.tangential.force;
        }
        if let Some(torque) = self.rolling_torque.get_mut(entry) {
            torque.0 = history.rolling.torque;
        }
    }

    /// All that the contact at an entry remembers.
    #[inline(always)]
    pub fn remember(&mut self, entry: usize, active: bool, history: &History) {
        self.set_history(entry, history);
        self.set_active(entry, active);
    }

    /// Whether the contact at this entry is active, so that what it remembers counts.
    #[inline(always)]
    pub fn set_active(&mut self, entry: usize, active: bool) {
        let tagged = &mut self.neighbour[entry];
        *tagged = *tagged & INDEX | if active { self.active } else { 0 };
    }
}

/// Run a function on the lists of every run of grains, which it may change.
pub fn with_lists<T: Send, R: Send>(
    s: &mut State,
    items: impl IndexedParallelIterator<Item = T>,
    of: impl Fn(&State, usize, T, Lists) -> R + Sync + Send,
    reduce: impl Fn(R, R) -> R + Sync + Send,
    zero: impl Fn() -> R + Sync + Send,
) -> R {
    let active = if s.model.history == Slot::Kept { ACTIVE } else { 0 };
    let (mut neighbour, mut tangential_force) = (take(&mut s.neighbour), take(&mut s.tangential_force));
    let mut rolling_torque = take(&mut s.rolling_torque);
    let result = items
        .zip(by_entry(&mut neighbour, s))
        .zip(by_entry(&mut tangential_force, s))
        .zip(by_entry(&mut rolling_torque, s))
        .enumerate()
        .with_min_len(2)
        .map(|(k, (((item, neighbour), tangential_force), rolling_torque))| {
            of(s, k, item, Lists { active, neighbour, tangential_force, rolling_torque })
        })
        .reduce(zero, reduce);
    (s.neighbour, s.tangential_force, s.rolling_torque) = (neighbour, tangential_force, rolling_torque);
    result
}

/// Whether the contact at this entry is active, so that what it remembers counts.
#[inline(always)]
pub fn set_active(tagged: &mut u32, active: bool) {
    *tagged = *tagged & INDEX | if active { ACTIVE } else { 0 };
}

/// Entries whose contacts grain i hands to the history: those it shares with a grain of larger index, or a wall.
pub fn active_contacts(s: &State, i: usize) -> impl Iterator<Item = usize> {
    let kept = move |tagged: u32| tagged != NONE && tagged & ACTIVE != 0 && (tagged & INDEX) as usize > i;
    s.row(i).filter(move |&entry| kept(s.neighbour[entry]))
}

/// Where the contact of grain i and neighbour j is in the history, and whether it is this grain's to count: the history
/// has it as this grain sees it.
pub fn restore_history(s: &State, i: usize, j: u32) -> Option<(usize, bool)> {
    let mine = s.sorted[i];
    let (owner, other) = match s.sorted.get(j as usize) {
        Some(&theirs) => (mine.min(theirs), mine.max(theirs)),
        None => (mine, j),
    };
    let mut kept = s.history_start[owner as usize]..s.history_start[owner as usize + 1];
    let at = kept.find(|&at| s.history_other[at as usize] == other)?;
    Some((at as usize, owner == mine))
}

/// Every array of what contacts remember, with the one that holds it in the history, and how one grain's value becomes
/// the other's.
macro_rules! for_lanes {
    ($s:ident, |$lane:ident, $history:ident, $opposite:ident| $body:expr) => {{
        fn negative(f: Packed) -> Packed {
            Packed(-f.0)
        }
        {
            let ($lane, $history, $opposite) = (&mut $s.tangential_force, &mut $s.history_tangential_force, negative);
            $body
        }
        {
            let opposite = |torque: Spin| Spin(-torque.0);
            let ($lane, $history, $opposite) = (&mut $s.rolling_torque, &mut $s.history_rolling_torque, opposite);
            $body
        }
        {
            let ($lane, $history, $opposite) = (&mut $s.impulse, &mut $s.history_impulse, negative);
            $body
        }
    }};
}

/// Hand contacts to the history, those of every run of grains: entries and their places there, counted from the first of
/// the run.
pub fn store_lanes(s: &mut State, moves: &[Vec<(usize, usize)>]) {
    for_lanes!(s, |lane, history, _opposite| {
        if !lane.is_empty() {
            by_history(history, &s.history_start, s.sizes.bodies).zip(moves).for_each(|(history, moves)| {
                moves.iter().for_each(|&(entry, at)| history[at] = lane[entry]);
            });
        }
    });
}

/// A contact that comes back from the history.
#[derive(Clone, Copy, Debug)]
pub struct Restored {
    /// Counted from the first of the run of grains.
    pub entry: usize,
    /// Its place there.
    pub at: usize,
    /// Whether the grain sees it as the history does.
    pub same: bool,
}

/// Take contacts from the history, those of every run of grains.
pub fn restore_lanes(s: &mut State, contacts: &[Vec<Restored>]) {
    for_lanes!(s, |lane, history, opposite| {
        let runs = by_entry_of(lane, &s.list_start, &s.sizes);
        runs.zip(contacts).filter(|(lane, _)| !lane.is_empty()).for_each(|(lane, contacts)| {
            for &Restored { entry, at, same } in contacts {
                lane[entry] = if same { history[at] } else { opposite(history[at]) };
            }
        });
    });
}
