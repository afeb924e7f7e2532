//! Twin of `shaders/paint.wgsl`: contacts that both grains have named get the first colour that neither has, and a place among
//! those of the colour.

use crate::{
    laws::{grains::members, rigid::filled},
    state::{Hue, INDEX, NONE, State},
};
use rayon::prelude::*;

pub fn paint(s: &mut State) {
    s.palette[0].uncoloured = 0;
    let agreed = |&i: &usize| match s.proposal[i] {
        NONE => false,
        j => s.proposal.get(j as usize).is_none_or(|&answer| answer as usize == i),
    };
    let grains = (0..s.sizes.bodies).into_par_iter().filter(agreed);
    let colours: Vec<(usize, u32)> = grains.map(|i| (i, colour_of(s, i))).collect();
    for (i, colour) in colours {
        let j = s.proposal[i] as usize;
        let slot = filled(s, i).find(|&slot| (s.neighbour[slot] & INDEX) as usize == j);
        s.palette[0].colours = s.palette[0].colours.max(colour);
        let mut rank = 0;
        // Of a colour too many nobody counts the contacts; the host makes room, and begins again.
        if let Some(painted) = s.painted.get_mut(colour as usize - 1).filter(|_| i < j) {
            rank = *painted;
            *painted += 1;
            s.palette[0].contacts += 1;
        }
        s.hue[slot.expect("proposals are neighbours")] = Hue { colour, rank };
    }
}

/// The first colour that is free at both grains of the contact that body i has named.
fn colour_of(s: &State, i: usize) -> u32 {
    let j = s.proposal[i] as usize;
    let others = |i: usize, j: usize| {
        let slots = members(s, i).flat_map(move |member| filled(s, member).map(move |slot| (member, slot)));
        slots
            .filter(move |&(member, slot)| member != i || (s.neighbour[slot] & INDEX) as usize != j)
            .map(|(_, slot)| slot)
    };
    let mut taken: Vec<u32> = others(i, j).map(|slot| s.hue[slot].colour).collect();
    if j < s.sizes.bodies {
        taken.extend(others(j, i).map(|slot| s.hue[slot].colour));
    }
    (1..).find(|colour| !taken.contains(colour)).expect("there are more colours than contacts of two grains")
}
