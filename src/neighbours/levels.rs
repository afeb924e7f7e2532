//! Twin of `shaders/neighbours/levels/`: grains of one size, or of many. A pair of two levels is found by its finer
//! grain, around which there are few cells of coarser levels. In each list, neighbours on other levels have the last
//! entries until the list is ordered.

use crate::state::State;

/// The level of grains of this radius.
#[inline(always)]
pub fn level_of(s: &State, radius: f64) -> usize {
    let coarsest = s.level.len() - 1;
    s.level[..coarsest].iter().position(|level| radius <= level.radius).unwrap_or(coarsest)
}

/// Entries of grain i for neighbours on other levels.
#[inline(always)]
pub fn entries_across(s: &State, i: usize) -> usize {
    s.across.get(i).map_or(0, |entries| *entries as usize)
}

/// How many of them have been filled.
#[inline(always)]
pub fn filled_across(s: &State, i: usize) -> usize {
    s.across_filled.get(i).map_or(0, |entries| *entries as usize)
}
