//! Twin of `shaders/space/move_walls.wgsl`: moving walls, n to n + 1.

use crate::{
    space::walls::moved,
    state::{HALTED, State},
};

pub fn move_walls(s: &mut State) {
    // A step that has lost a body will be taken back.
    if s.halt[0] >= HALTED || s.counters[0].lost_body > 0 {
        return;
    }
    for w in 0..s.sizes.walls {
        s.wall[w] = moved(s, &s.wall[w]);
    }
}
