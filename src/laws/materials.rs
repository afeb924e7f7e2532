//! Twin of `shaders/materials/`.

use crate::{
    model::Materials,
    state::{Pair, State},
};

/// Contact parameters of i and j; wall w is number `bodies + w`.
pub fn pair_of(s: &State, i: usize, j: usize) -> Pair {
    match s.model.materials {
        Materials::One => s.params.pair,
        Materials::Many => s.pair[s.material[i] as usize * s.params.materials as usize + s.material[j] as usize],
    }
}
