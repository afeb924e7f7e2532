//! Twin of `shaders/body/bodies.wgsl`.

use super::{Body, rotation::spin_of};
use crate::{
    space::{
        dimension::outside,
        precision::{Point, accelerated, accelerated_spin, position_low_of},
    },
    state::{Position, PositionLow, Spin, State, Velocity, VelocityLow},
};
use glam::DVec3;

/// Grain i.
#[inline(always)]
pub fn body(s: &State, i: usize) -> Body {
    Body { position: s.position[i], low: position_low_of(s, i), velocity: s.velocity[i], spin: spin_of(s, i) }
}

/// Velocities after a change.
#[derive(Clone, Copy, Debug)]
pub struct Velocities {
    pub velocity: Velocity,
    pub spin: Spin,
    pub low: VelocityLow,
}

impl Velocities {
    /// Of these, with low parts and an inverse mass, after a change.
    #[inline(always)]
    pub fn changed(s: &State, velocity: Velocity, spin: DVec3, low: VelocityLow, change: [DVec3; 2]) -> Velocities {
        let v = accelerated(s, velocity.v, low.v, change[0]);
        let w = accelerated_spin(s, spin, low.spin, change[1]);
        Velocities {
            velocity: Velocity { v: v.value, ..velocity },
            spin: Spin(w.value),
            low: VelocityLow { v: v.low, spin: w.low },
        }
    }
}

/// Grain i changes its velocity and its spin by this much.
#[inline(always)]
pub fn changed_velocities(s: &State, i: usize, here: &Body, change: DVec3, spin_change: DVec3) -> Velocities {
    let low = s.velocity_low.get(i).copied().unwrap_or_default();
    Velocities::changed(s, here.velocity, here.spin, low, [change, spin_change])
}

/// The velocities of a run of bodies.
pub struct NextVelocities<'a> {
    pub velocity: &'a mut [Velocity],
    /// This and the next empty where the model has none.
    pub spin: &'a mut [Spin],
    pub low: &'a mut [VelocityLow],
}

impl NextVelocities<'_> {
    #[inline(always)]
    pub fn store(&mut self, k: usize, next: Velocities) {
        self.velocity[k] = next.velocity;
        if let Some(spin) = self.spin.get_mut(k) {
            *spin = next.spin;
        }
        if let Some(low) = self.low.get_mut(k) {
            *low = next.low;
        }
    }
}

/// Where a run of bodies comes to.
pub struct NextPositions<'a> {
    pub position: &'a mut [Position],
    /// Empty where the model has none.
    pub low: &'a mut [PositionLow],
    /// m, way since the lists were made
    pub displacement: &'a mut [f64],
}

/// What the places that bodies have come to say of the run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Mark of the first lost body (0: none): one that is beyond the domain or a wall, or moves or turns too fast to be
    /// followed.
    pub lost_body: u32,
    /// Whether the lists may miss a neighbour from now on, or a body is lost.
    pub halt: bool,
}

impl Limits {
    #[inline(always)]
    pub fn and(self, other: Limits) -> Limits {
        Limits { lost_body: self.lost_body.max(other.lost_body), halt: self.halt | other.halt }
    }
}

impl NextPositions<'_> {
    /// Body i, the k-th of the run, has come to this point by a way of this length, m; `hopeless` if it is lost for what
    /// the caller has found.
    #[inline(always)]
    pub fn commit_position(
        &mut self,
        s: &State,
        (i, k): (usize, usize),
        point: Point,
        stride: f64,
        hopeless: bool,
    ) -> Limits {
        self.position[k] = Position { x: point.x, radius: s.position[i].radius };
        if let Some(low) = self.low.get_mut(k) {
            *low = PositionLow { x: point.low, radius: position_low_of(s, i).radius };
        }
        self.displacement[k] += stride;
        let lost = hopeless || outside(point.x, s.params.lower, s.params.upper) || !(stride <= s.params.step_limit);
        Limits {
            lost_body: if lost { s.params.bodies - s.id[i] } else { 0 },
            halt: lost || !(self.displacement[k] <= s.params.displacement_limit),
        }
    }
}
