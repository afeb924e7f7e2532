//! Twin of `shaders/move_walls.wgsl`: moving walls, n to n + 1.

use crate::state::State;

pub fn move_walls(s: &mut State) {
    for wall in &mut s.wall {
        wall.point += s.params.dt * wall.velocity;
    }
}
