//! The law of grain contacts, `shaders/contact.wgsl`, for many at a time: the same function, in a loop over arrays that the
//! compiler turns into vectors. On a device every lane of a vector is an invocation, and WGSL needs nothing like this.

use super::{
    contact::{Gathered, Law, Meeting, grain_contact, way_to},
    materials::pair_of,
    precision::residue_of,
    rotation::spin_of,
};
use crate::{
    model::{Dashpot, Friction, Materials, Precision, Rotation},
    state::{Pair, State},
};
use glam::DVec3;

/// Contacts computed at a time.
pub const LANES: usize = 32;

type Row = [f64; LANES];
type Rows = [Row; 3];

/// A list entry: grain i, its neighbour j, and where in the list that is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Side {
    pub i: u32,
    pub j: u32,
    pub slot: u32,
}

/// Meetings, number by number. Rows of what the model does not have stay as they are.
struct Meetings {
    way: Rows,
    v: Rows,
    spin: Rows,
    spin_to: Rows,
    old: Rows,
    radius: Row,
    radius_to: Row,
    radii_rest: Row,
    inverse_mass: Row,
    stiffness: Row,
    tangential_stiffness: Row,
    friction: Row,
    dashpot: Row,
}

/// What comes of them.
struct Contacts {
    gap: Row,
    spring: Rows,
    force: Rows,
    torque: Rows,
}

/// Contacts of grains, side by side.
pub struct Batch {
    meetings: Meetings,
    contacts: Contacts,
}

/// What a step wants to know of a contact.
pub struct Outcome {
    /// m; >= 0: no contact, and nothing below means anything.
    pub gap: f64,
    /// N
    pub spring: DVec3,
    pub sum: Gathered,
}

#[inline(always)]
fn at(rows: &Rows, lane: usize) -> DVec3 {
    DVec3::new(rows[0][lane], rows[1][lane], rows[2][lane])
}

#[inline(always)]
fn set(rows: &mut Rows, lane: usize, v: DVec3) {
    (rows[0][lane], rows[1][lane], rows[2][lane]) = (v.x, v.y, v.z);
}

impl Batch {
    /// For the contacts of a scene.
    pub fn new(s: &State) -> Batch {
        let (row, rows) = ([0.0; LANES], [[0.0; LANES]; 3]);
        let Pair { stiffness, tangential_stiffness, friction, dashpot } = s.params.pair;
        Batch {
            meetings: Meetings {
                way: rows,
                v: rows,
                spin: rows,
                spin_to: rows,
                old: rows,
                radius: row,
                radius_to: row,
                radii_rest: row,
                inverse_mass: row,
                stiffness: [stiffness; LANES],
                tangential_stiffness: [tangential_stiffness; LANES],
                friction: [friction; LANES],
                dashpot: [dashpot; LANES],
            },
            contacts: Contacts { gap: row, spring: rows, force: rows, torque: rows },
        }
    }

    /// Contacts of grains, at most as many as there are lanes; `old` is the spring of a side a step ago, N.
    #[inline(always)]
    pub fn compute(&mut self, s: &State, sides: &[Side], old: impl Fn(&Side) -> DVec3) {
        self.meetings.fill(s, sides, old);
        let law = Law::of(s);
        // The compiler is told the choices one by one, so that the loop over the lanes has none.
        match law.friction {
            Friction::None => self.compute_friction(Law { friction: Friction::None, ..law }),
            Friction::Coulomb => self.compute_friction(Law { friction: Friction::Coulomb, ..law }),
        }
    }

    #[inline(always)]
    fn compute_friction(&mut self, law: Law) {
        match law.dashpot {
            Dashpot::None => self.compute_lanes(Law { dashpot: Dashpot::None, ..law }),
            Dashpot::Restitution => self.compute_lanes(Law { dashpot: Dashpot::Restitution, ..law }),
            Dashpot::MassScaled => self.compute_lanes(Law { dashpot: Dashpot::MassScaled, ..law }),
        }
    }

    #[inline(always)]
    fn compute_lanes(&mut self, law: Law) {
        let Batch { meetings, contacts } = self;
        for lane in 0..LANES {
            let contact = grain_contact(law, &meetings.at(lane));
            let mut sum = Gathered::default();
            sum.add(&contact);
            contacts.gap[lane] = contact.gap;
            set(&mut contacts.spring, lane, contact.spring);
            set(&mut contacts.force, lane, sum.force);
            set(&mut contacts.torque, lane, sum.torque);
        }
    }

    /// What came of a side.
    #[inline(always)]
    pub fn outcome(&self, lane: usize) -> Outcome {
        let c = &self.contacts;
        let sum = Gathered { force: at(&c.force, lane), torque: at(&c.torque, lane) };
        Outcome { gap: c.gap[lane], spring: at(&c.spring, lane), sum }
    }
}

impl Meetings {
    /// The same as [`super::contact::meeting`], an array at a time: short loops without choices in them.
    #[inline(always)]
    fn fill(&mut self, s: &State, sides: &[Side], old: impl Fn(&Side) -> DVec3) {
        assert!(sides.len() <= LANES);
        let sides = || sides.iter().enumerate().map(|(lane, side)| (lane, side.i as usize, side.j as usize, side));
        for (lane, i, j, _) in sides() {
            set(&mut self.way, lane, way_to(s, i, j));
            (self.radius[lane], self.radius_to[lane]) = (s.place[i].radius, s.place[j].radius);
            let (here, there) = (&s.motion[i], &s.motion[j]);
            set(&mut self.v, lane, here.v - there.v);
            self.inverse_mass[lane] = here.inverse_mass + there.inverse_mass;
        }
        if s.model.rotation == Rotation::Sphere {
            for (lane, i, j, _) in sides() {
                set(&mut self.spin, lane, spin_of(s, i));
                set(&mut self.spin_to, lane, spin_of(s, j));
            }
        }
        if s.model.friction == Friction::Coulomb {
            for (lane, _, _, side) in sides() {
                set(&mut self.old, lane, old(side));
            }
        }
        if s.model.precision == Precision::Single {
            for (lane, i, j, _) in sides() {
                self.radii_rest[lane] = residue_of(s, i).radius + residue_of(s, j).radius;
            }
        }
        if s.model.materials == Materials::Many {
            for (lane, i, j, _) in sides() {
                let pair = pair_of(s, i, j);
                self.stiffness[lane] = pair.stiffness;
                self.tangential_stiffness[lane] = pair.tangential_stiffness;
                self.friction[lane] = pair.friction;
                self.dashpot[lane] = pair.dashpot;
            }
        }
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> Meeting {
        Meeting {
            way: at(&self.way, lane),
            v: at(&self.v, lane),
            spin: at(&self.spin, lane),
            spin_to: at(&self.spin_to, lane),
            old: at(&self.old, lane),
            radius: self.radius[lane],
            radius_to: self.radius_to[lane],
            radii_rest: self.radii_rest[lane],
            inverse_mass: self.inverse_mass[lane],
            pair: Pair {
                stiffness: self.stiffness[lane],
                tangential_stiffness: self.tangential_stiffness[lane],
                friction: self.friction[lane],
                dashpot: self.dashpot[lane],
            },
        }
    }
}
