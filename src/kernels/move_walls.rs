//! Twin of `shaders/move_walls.wgsl`: moving walls, n to n + 1.

use crate::{laws::precision::moved, state::State};

pub fn move_walls(s: &mut State) {
    if s.halt[0] != 0 {
        return;
    }
    for w in 0..s.sizes.walls {
        let point = moved(s, s.wall[w].point, s.wall[w].residue, s.params.dt * s.wall[w].velocity);
        (s.wall[w].point, s.wall[w].residue) = (point.x, point.residue);
    }
}
