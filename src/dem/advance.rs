//! Twin of `shaders/dem/advance.wgsl`: contact forces at step n, then leapfrog: n - 1/2 to n + 1/2 (2.19), n to n + 1
//! (2.20). Large grains have a stage of their own.

use crate::body::blocks::{BLOCK, by_body, first_entry};
use crate::{
    body::{
        Body, ForceTorque,
        bodies::{Limits, NextPositions, NextVelocities, body, changed_velocities},
        rotation::{sphere_spin_change, spin_change},
    },
    contact::{
        history::{Lists, with_lists},
        law::{Contact, contact_with},
    },
    dem::leapfrog::velocity_change,
    model::{Boundary, Precision},
    space::{
        boundary::{approach, carried, wrap},
        precision::displaced,
        walls::is_crossed,
    },
    state::{HALTED, INDEX, NONE, Position, PositionLow, Spin, State, Velocity, VelocityLow},
};
use rayon::prelude::*;
use std::{mem::take, ops::Range};

pub fn advance(s: &mut State) {
    if begin_step(s) {
        advance_bodies(s, 0..s.sizes.bodies - s.sizes.large);
    } else {
        s.halt_next[0] = HALTED;
    }
}

/// Count a step, unless it is halted: whether it is not.
pub fn begin_step(s: &mut State) -> bool {
    let halted = s.halt[0] >= HALTED;
    if !halted {
        s.counters[0].steps_done += 1;
        s.halt_next[0] = s.halt[0] + 1;
    }
    !halted
}

/// What a step has come to.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outcome {
    pub limits: Limits,
    /// A contact is deep.
    pub deep: bool,
}

impl Outcome {
    pub fn and(self, other: Outcome) -> Outcome {
        Outcome { limits: self.limits.and(other.limits), deep: self.deep | other.deep }
    }
}

/// What bodies and their contacts say of the step.
pub fn end_step(s: &mut State, Outcome { limits, deep }: Outcome) {
    s.counters[0].lost_body = s.counters[0].lost_body.max(limits.lost_body);
    s.counters[0].deep_overlaps = s.counters[0].deep_overlaps.max(u32::from(deep));
    if limits.halt | deep {
        s.halt_next[0] = HALTED;
    }
}

/// Advance these grains.
pub fn advance_bodies(s: &mut State, bodies: Range<usize>) {
    let mut next = Next::take(s);
    let work = |s: &State, k: usize, mut next: NextOfBlock, mut lists: Lists| {
        let first = k * BLOCK;
        let run = bodies.start.max(first)..bodies.end.min(first + next.len());
        let of_body = |i: usize| {
            let here = body(s, i);
            let BodyForces { sum, crossed, deep } = contact_forces(s, first, i, &here, &mut lists);
            Outcome { limits: next.advance(s, (i, i - first), &here, &sum, crossed), deep }
        };
        run.map(of_body).fold(Outcome::default(), Outcome::and)
    };
    let blocks = next.blocks(s);
    let outcome = with_lists(s, blocks, work, Outcome::and, Outcome::default);
    next.put(s);
    end_step(s, outcome);
}

/// What all contacts do to a body in a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct BodyForces {
    pub sum: ForceTorque,
    /// Its centre is beyond a wall.
    pub crossed: bool,
    /// One of them is deep.
    pub deep: bool,
}

/// Whether the centre of a grain is beyond the neighbour of this contact, which may be a wall.
pub fn is_beyond(s: &State, here: &Body, j: usize, contact: &Contact) -> bool {
    j >= s.sizes.bodies && is_crossed(s, contact.gap, here.position.radius)
}

/// What the contacts of grain i of a block do to it; the first grain of the block is `first`.
pub fn contact_forces(s: &State, first: usize, i: usize, here: &Body, lists: &mut Lists) -> BodyForces {
    let mut forces = BodyForces::default();
    for entry in s.row(i).from(first_entry(s, first)) {
        let tagged = lists.neighbour[entry];
        if tagged == NONE {
            break;
        }
        let j = (tagged & INDEX) as usize;
        let contact = contact_with(s, i, here, j, lists.is_active(entry), lists.history(entry));
        if contact.is_active {
            lists.set_history(entry, &contact.history);
            forces.sum.add(&contact);
            forces.crossed |= is_beyond(s, here, j, &contact);
            forces.deep |= contact.is_deep;
        }
        lists.set_active(entry, contact.is_active);
    }
    forces
}

/// What comes next, taken out of the state.
pub struct Next {
    position: Vec<Position>,
    low: Vec<PositionLow>,
    displacement: Vec<f64>,
    velocity: Vec<Velocity>,
    spin: Vec<Spin>,
    velocity_low: Vec<VelocityLow>,
}

/// What a task writes, of a run of grains.
pub struct NextOfBlock<'a> {
    positions: NextPositions<'a>,
    velocities: NextVelocities<'a>,
}

impl Next {
    pub fn take(s: &mut State) -> Next {
        Next {
            position: take(&mut s.position_next),
            low: take(&mut s.position_low_next),
            displacement: take(&mut s.displacement),
            velocity: take(&mut s.velocity_next),
            spin: take(&mut s.spin_next),
            velocity_low: take(&mut s.velocity_low_next),
        }
    }

    pub fn put(self, s: &mut State) {
        (s.position_next, s.position_low_next, s.displacement) = (self.position, self.low, self.displacement);
        (s.velocity_next, s.spin_next, s.velocity_low_next) = (self.velocity, self.spin, self.velocity_low);
    }

    pub fn blocks<'a>(&'a mut self, s: &State) -> impl IndexedParallelIterator<Item = NextOfBlock<'a>> + use<'a> {
        by_body(&mut self.position, s)
            .zip(by_body(&mut self.low, s))
            .zip(by_body(&mut self.displacement, s))
            .zip(by_body(&mut self.velocity, s))
            .zip(by_body(&mut self.spin, s))
            .zip(by_body(&mut self.velocity_low, s))
            .map(|(((((position, low), displacement), velocity), spin), velocity_low)| NextOfBlock {
                positions: NextPositions { position, low, displacement },
                velocities: NextVelocities { velocity, spin, low: velocity_low },
            })
    }
}

impl NextOfBlock<'_> {
    fn len(&self) -> usize {
        self.positions.position.len()
    }

    /// Body i, the k-th of the run, moves under what acts on it; it is lost if its centre is beyond a wall.
    #[inline(always)]
    pub fn advance(&mut self, s: &State, at: (usize, usize), here: &Body, sum: &ForceTorque, crossed: bool) -> Limits {
        match (s.model.precision, s.model.boundary) {
            (Precision::Double, Boundary::Open) => self.move_body(s, Boundary::Open, at, here, sum, crossed),
            (Precision::Double, Boundary::Periodic) => self.move_body(s, Boundary::Periodic, at, here, sum, crossed),
            (_, boundary) => self.move_body_apart(s, boundary, at, here, sum, crossed),
        }
    }

    /// Apart, so that nothing goes through memory for the sake of low parts, or of a flow, where there are none.
    #[inline(never)]
    fn move_body_apart(
        &mut self,
        s: &State,
        boundary: Boundary,
        at: (usize, usize),
        here: &Body,
        sum: &ForceTorque,
        crossed: bool,
    ) -> Limits {
        self.move_body(s, boundary, at, here, sum, crossed)
    }

    #[inline(always)]
    fn move_body(
        &mut self,
        s: &State,
        boundary: Boundary,
        (i, k): (usize, usize),
        here: &Body,
        sum: &ForceTorque,
        crossed: bool,
    ) -> Limits {
        let change = velocity_change(s, boundary, &here.velocity, sum.force);
        let changed = changed_velocities(s, i, here, change, sphere_spin_change(s, here, sum.torque, spin_change));
        let v = changed.velocity.v;
        self.velocities.store(k, changed);
        let step = s.params.dt * carried(s, boundary, here.position.x, v);
        let point = wrap(s, boundary, displaced(s, here.position.x, here.low.x, step));
        let stride = approach(s, boundary, s.params.dt * v.length(), here.position.radius);
        self.positions.commit_position(s, (i, k), point, stride, crossed)
    }
}
