//! Twin of `shaders/space/move_walls.wgsl`: moving walls, n to n + 1.

use crate::{
    space::precision::{Point, displaced, requantised},
    state::{HALTED, State},
};

pub fn move_walls(s: &mut State) {
    // A step that has lost a body will be taken back.
    if s.halt[0] >= HALTED || s.counters[0].lost_body > 0 {
        return;
    }
    for w in 0..s.sizes.walls {
        let start = requantised(s, Point { x: s.wall[w].point, low: s.wall[w].low });
        let point = displaced(s, start.x, start.low, s.params.dt * s.wall[w].velocity);
        (s.wall[w].point, s.wall[w].low) = (point.x, point.low);
    }
}
