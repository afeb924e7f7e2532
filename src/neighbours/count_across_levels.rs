//! Twin of `shaders/neighbours/count_across_levels.wgsl`: how many entries each grain needs for neighbours on other
//! levels.

use crate::{
    neighbours::grid::{counting_slack, pairs_across_levels},
    state::State,
};

pub fn count_across_levels(s: &mut State) {
    for (i, j) in pairs_across_levels(s, counting_slack).into_iter().flatten() {
        s.across[i] += 1;
        s.across[j] += 1;
    }
}
