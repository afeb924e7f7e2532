//! What shapes are made of.

use glam::{DMat3, DVec3};

/// A sphere or disk of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Centre, from the shape's own: along its principal axes once the shape is finished, see
    /// [`Shape::members`](super::Shape::members).
    pub arm: DVec3,
    pub radius: f64,
}

/// Mass properties at density 1, in the unit of the shape.
pub struct Mass {
    pub volume: f64,
    pub center: DVec3,
    /// About the centre.
    pub inertia: DMat3,
}
