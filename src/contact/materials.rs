//! Twin of `shaders/contact/materials/`: the parameters of a contact.

use super::{damping, normal, tangential};
use crate::{
    model::Materials,
    scene,
    state::{Pair, State},
};

/// Contact parameters of i and j; wall w is number `bodies + w`.
#[inline(always)]
pub fn pair_of(s: &State, i: usize, j: usize) -> Pair {
    match s.model.materials {
        Materials::One => s.params.pair,
        Materials::Many => s.pair[pair_index(s, i, j)],
    }
}

/// Where the pair of materials of i and j is in the tables of pairs.
#[inline(always)]
pub fn pair_index(s: &State, i: usize, j: usize) -> usize {
    match s.model.materials {
        Materials::One => 0,
        Materials::Many => material_of(s, i) * s.params.materials as usize + material_of(s, j),
    }
}

/// The material of grain i, or of a wall.
#[inline(always)]
pub fn material_of(s: &State, i: usize) -> usize {
    if s.model.materials == Materials::One {
        return 0;
    }
    s.material[s.id.get(i).map_or(i, |id| *id as usize)] as usize
}

/// The parameters of a pair of materials as the kernels want them.
pub fn parameters(pair: &scene::Pair) -> Pair {
    Pair {
        stiffness: normal::parameter(pair),
        tangential_stiffness: tangential::parameter(pair),
        friction: pair.friction,
        dashpot: damping::parameter(pair),
    }
}
