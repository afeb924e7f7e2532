//! Twin of `shaders/space/guide_walls.wgsl`: walls that move as the host says, n to n + 1.

use crate::state::{HALTED, State, Wall};

pub fn guide_walls(s: &mut State) {
    let step = s.halt[0];
    // A step that has lost a body will be taken back.
    if step >= HALTED || s.counters[0].lost_body > 0 {
        return;
    }
    let walls = s.sizes.walls;
    for (wall, next) in s.wall[..walls].iter_mut().zip(&s.wall_path[step as usize * walls..]) {
        *wall = Wall { radius: wall.radius, radius_low: wall.radius_low, ..*next };
    }
}
