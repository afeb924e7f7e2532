//! Twin of `shaders/judge.wgsl`: how far the impulses are from a solution, by the natural map, which anyone can compute again.

use crate::{
    laws::{
        friction::kept_spring,
        rigid::{by_group, filled, natural_map, side_of},
    },
    state::{Effort, State},
};
use glam::DVec3;

pub fn judge(s: &mut State) {
    s.effort = by_group(s, |i| judged(s, i));
}

fn judged(s: &State, i: usize) -> Effort {
    let at = |i: usize| (s.trial[i].v, s.trial_spin.get(i).map_or(DVec3::ZERO, |spin| spin.0));
    let mut effort = Effort::default();
    for slot in filled(s, i) {
        let side = side_of(s, i, slot, at);
        let impulse = side.turn * kept_spring(&s.spring[slot]);
        let pressing = -impulse.dot(side.n);
        let friction = impulse + pressing * side.n;
        effort.residual += side.share * natural_map(&side, impulse).length_squared();
        effort.pressing = effort.pressing.max(pressing);
        effort.excess = effort.excess.max(friction.length() - side.friction * pressing);
    }
    effort
}
