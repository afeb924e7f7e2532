//! Twin of `shaders/space/move_walls.wgsl`: moving walls, n to n + 1.

use crate::{
    space::walls::moved,
    state::{HALTED, State},
};

pub fn move_walls(s: &mut State) {
    if s.halt[0] >= HALTED {
        return;
    }
    for w in 0..s.sizes.walls {
        s.wall[w] = moved(s, &s.wall[w]);
    }
}
