//! Space: dimension, boundaries, walls, and how single precision keeps positions.

pub mod boundary;
pub mod dimension;
mod move_walls;
pub mod precision;
pub mod walls;

use crate::stage::*;

/// Moving walls.
pub static MOVE_WALLS: Stage = Stage::new("space", "move_walls", move_walls::move_walls, |sizes| sizes.walls);
