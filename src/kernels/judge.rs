//! Twin of `shaders/judge.wgsl`: how far the impulses are from a solution, by the natural map, which anyone can compute again.

use crate::{
    laws::{
        answer::weight_of,
        friction::{flag, kept_spring},
        rigid::{Side, filled, keep_efforts, natural_map, side_of},
    },
    state::{Effort, SPRUNG, State},
};
use glam::DVec3;
use rayon::prelude::*;

pub fn judge(s: &mut State) {
    keep_efforts(s, judged);
    let late: Vec<usize> = (0..s.sizes.bodies).into_par_iter().flat_map_iter(|i| late(s, i)).collect();
    late.into_iter().for_each(|slot| flag(&mut s.neighbour[slot], true));
}

/// Velocity and spin after the last pass.
fn at(s: &State, i: usize) -> (DVec3, DVec3) {
    (s.trial[i].v, s.trial_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0))
}

/// Slots of pairs that were left out and meet after all: they take part from now on.
fn late(s: &State, i: usize) -> impl Iterator<Item = usize> + '_ {
    filled(s, i).filter(move |&slot| is_late(s, slot, &side_of(s, i, slot, |i| at(s, i))))
}

fn is_late(s: &State, slot: usize, side: &Side) -> bool {
    s.neighbour[slot] & SPRUNG == 0 && side.velocity.dot(side.n) > side.closing
}

fn judged(s: &State, i: usize) -> Effort {
    let mut effort = Effort::default();
    for slot in filled(s, i) {
        let side = side_of(s, i, slot, |i| at(s, i));
        effort.late += u32::from(is_late(s, slot, &side));
        let impulse = side.turn * kept_spring(&s.spring[slot]);
        let pressing = -impulse.dot(side.n);
        let friction = impulse + pressing * side.n;
        effort.residual +=
            side.share * natural_map(&side, impulse, weight_of(s, slot, side.tangential)).length_squared();
        effort.pressing = effort.pressing.max(pressing);
        effort.excess = effort.excess.max(friction.length() - side.friction * pressing);
    }
    effort
}
