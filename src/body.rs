//! Bodies: spheres, disks and members of clumps; how they turn, and what a clump is.

pub mod blocks;
pub mod bodies;
pub mod grains;
pub mod plan;
pub mod rotation;

use crate::state::{Position, PositionLow, Velocity};
use glam::DVec3;

/// All there is to know of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct Body {
    pub position: Position,
    pub low: PositionLow,
    pub velocity: Velocity,
    /// rad/s
    pub spin: DVec3,
}

/// Force, N, and moment, N m, of all contacts of a grain.
#[derive(Clone, Copy, Debug, Default)]
pub struct ForceTorque {
    pub force: DVec3,
    pub torque: DVec3,
}
