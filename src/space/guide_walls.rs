//! Twin of `shaders/space/guide_walls.wgsl`: walls that move as the host says, n to n + 1, and those that a servo moves.

use crate::{
    space::walls::moved,
    state::{HALTED, State, Wall},
};

pub fn guide_walls(s: &mut State) {
    let step = s.halt[0];
    // A step that has lost a body will be taken back.
    if step >= HALTED || s.counters[0].lost_body > 0 {
        return;
    }
    let walls = s.sizes.walls;
    for w in 0..walls {
        let now = s.wall[w];
        s.wall[w] = match now.driven {
            0 => {
                let next = s.wall_path[step as usize * walls + w];
                Wall { radius: now.radius, radius_low: now.radius_low, ..next }
            }
            _ => moved(s, &now),
        };
    }
}
