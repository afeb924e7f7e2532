//! Twin of `shaders/space/move_walls.wgsl`: moving walls, n to n + 1.

use crate::{space::precision::displaced, state::State};

pub fn move_walls(s: &mut State) {
    if s.halt[0] != 0 {
        return;
    }
    for w in 0..s.sizes.walls {
        let point = displaced(s, s.wall[w].point, s.wall[w].low, s.params.dt * s.wall[w].velocity);
        (s.wall[w].point, s.wall[w].low) = (point.x, point.low);
    }
}
