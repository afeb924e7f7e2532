//! The law of grain contacts, `shaders/contact/contacts.wgsl`, for many at a time: the same function, in a loop over
//! arrays that the compiler turns into vectors. On a device every lane of a vector is an invocation, and WGSL needs
//! nothing like this.

use crate::{
    body::{ForceTorque, bodies::body, rotation::spin_of},
    contact::{
        geometry::branch_vector,
        history::{History, Lists},
        law::{GrainPair, grain_contact, grain_pair},
        materials::pair_of,
        state::Law,
        tangential::TangentialHistory,
    },
    space::precision::position_low_of,
};
use crate::{
    model::{Cohesion, Damping, Materials, Normal, Precision, Rolling, Rotation, Tangential, Twist},
    state::{Pair, State},
};
use glam::DVec3;

/// Contacts computed at a time.
pub const LANES: usize = 32;

type Row = [f64; LANES];
type Rows = [Row; 3];

/// A list entry: grain i, its neighbour j, and where in the list that is.
#[derive(Clone, Copy, Debug, Default)]
pub struct ListEntry {
    pub i: u32,
    pub j: u32,
    pub index: u32,
}

/// Pairs of grains, number by number. Rows of what the model does not have stay as they are.
struct GrainPairs {
    branch: Rows,
    v: Rows,
    spin: Rows,
    spin_to: Rows,
    old_force: Rows,
    radius: Row,
    radius_to: Row,
    radii_rest: Row,
    /// Of both together: the laws served ask for no more.
    inverse_mass: Row,
    stiffness: Row,
    tangential_stiffness: Row,
    friction: Row,
    dashpot: Row,
}

/// What comes of them.
struct Contacts {
    gap: Row,
    tangential_force: Rows,
    force: Rows,
    torque: Rows,
}

/// Contacts of grains, side by side.
pub struct Batch {
    pairs: GrainPairs,
    contacts: Contacts,
}

/// What a step wants to know of a contact.
pub struct Outcome {
    /// If not, nothing below means anything.
    pub is_active: bool,
    pub history: History,
    pub sum: ForceTorque,
}

impl Outcome {
    /// Of one contact, by whatever law. Inlined, so that it is compiled for the vectors that machines have.
    #[inline(always)]
    pub fn of(s: &State, entry: &ListEntry, lists: &Lists) -> Outcome {
        let (i, j, at) = (entry.i as usize, entry.j as usize, entry.index as usize);
        let pair = grain_pair(s, i, &body(s, i), j, lists.history(at));
        let contact = grain_contact(Law::of(s), &pair, lists.is_active(at));
        Outcome {
            is_active: contact.is_active,
            history: contact.history,
            sum: ForceTorque { force: contact.force, torque: contact.torque },
        }
    }
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
    /// Whether its loops are made for the laws of a scene; contacts of others are computed one by one, [`Outcome::of`].
    pub fn serves(s: &State) -> bool {
        let m = &s.model;
        m.normal == Normal::Hooke
            && matches!(m.tangential, Tangential::None | Tangential::Coulomb)
            && m.rolling == Rolling::None
            && m.twist == Twist::Ignored
            && m.cohesion == Cohesion::None
    }

    /// For the contacts of a scene.
    pub fn new(s: &State) -> Batch {
        let (row, rows) = ([0.0; LANES], [[0.0; LANES]; 3]);
        let Pair { stiffness, tangential_stiffness, friction, dashpot } = s.params.pair;
        Batch {
            pairs: GrainPairs {
                branch: rows,
                v: rows,
                spin: rows,
                spin_to: rows,
                old_force: rows,
                radius: row,
                radius_to: row,
                radii_rest: row,
                inverse_mass: row,
                stiffness: [stiffness; LANES],
                tangential_stiffness: [tangential_stiffness; LANES],
                friction: [friction; LANES],
                dashpot: [dashpot; LANES],
            },
            contacts: Contacts { gap: row, tangential_force: rows, force: rows, torque: rows },
        }
    }

    /// Contacts of grains, at most as many as there are lanes, with what they remember.
    #[inline(always)]
    pub fn compute(&mut self, s: &State, entries: &[ListEntry], lists: &Lists) {
        self.pairs.fill(s, entries, lists);
        let law = Law {
            normal: Normal::Hooke,
            rolling: Rolling::None,
            twist: Twist::Ignored,
            cohesion: Cohesion::None,
            ..Law::of(s)
        };
        // The compiler is told the choices one by one, so that the loop over the lanes has none.
        match law.tangential {
            Tangential::None => self.compute_damping(Law { tangential: Tangential::None, ..law }),
            _ => self.compute_damping(Law { tangential: Tangential::Coulomb, ..law }),
        }
    }

    #[inline(always)]
    fn compute_damping(&mut self, law: Law) {
        match law.damping {
            Damping::None => self.compute_lanes(Law { damping: Damping::None, ..law }),
            Damping::Restitution => self.compute_lanes(Law { damping: Damping::Restitution, ..law }),
            Damping::MassScaled => self.compute_lanes(Law { damping: Damping::MassScaled, ..law }),
        }
    }

    #[inline(always)]
    fn compute_lanes(&mut self, law: Law) {
        let Batch { pairs, contacts } = self;
        for lane in 0..LANES {
            let contact = grain_contact(law, &pairs.at(lane), false);
            let mut sum = ForceTorque::default();
            sum.add(&contact);
            contacts.gap[lane] = contact.gap;
            set(&mut contacts.tangential_force, lane, contact.history.tangential.force);
            set(&mut contacts.force, lane, sum.force);
            set(&mut contacts.torque, lane, sum.torque);
        }
    }

    /// What came of a contact; those of the laws it is made for act while surfaces overlap.
    #[inline(always)]
    pub fn outcome(&self, lane: usize) -> Outcome {
        let c = &self.contacts;
        let sum = ForceTorque { force: at(&c.force, lane), torque: at(&c.torque, lane) };
        let tangential = TangentialHistory { force: at(&c.tangential_force, lane) };
        Outcome { is_active: c.gap[lane] < 0.0, history: History { tangential, ..History::default() }, sum }
    }
}

impl GrainPairs {
    /// The same as [`grain_pair`], an array at a time: short loops without choices in them.
    #[inline(always)]
    fn fill(&mut self, s: &State, entries: &[ListEntry], lists: &Lists) {
        assert!(entries.len() <= LANES);
        let entries =
            || entries.iter().enumerate().map(|(lane, entry)| (lane, entry.i as usize, entry.j as usize, entry));
        for (lane, i, j, _) in entries() {
            set(&mut self.branch, lane, branch_vector(s, i, j));
            (self.radius[lane], self.radius_to[lane]) = (s.position[i].radius, s.position[j].radius);
            let (here, there) = (&s.velocity[i], &s.velocity[j]);
            set(&mut self.v, lane, here.v - there.v);
            self.inverse_mass[lane] = here.inverse_mass + there.inverse_mass;
        }
        if s.model.rotation == Rotation::Sphere {
            for (lane, i, j, _) in entries() {
                set(&mut self.spin, lane, spin_of(s, i));
                set(&mut self.spin_to, lane, spin_of(s, j));
            }
        }
        if s.model.tangential == Tangential::Coulomb {
            for (lane, _, _, entry) in entries() {
                set(&mut self.old_force, lane, lists.tangential_force(entry.index as usize));
            }
        }
        if s.model.precision == Precision::Single {
            for (lane, i, j, _) in entries() {
                self.radii_rest[lane] = position_low_of(s, i).radius + position_low_of(s, j).radius;
            }
        }
        if s.model.materials == Materials::Many {
            for (lane, i, j, _) in entries() {
                let pair = pair_of(s, i, j);
                self.stiffness[lane] = pair.stiffness;
                self.tangential_stiffness[lane] = pair.tangential_stiffness;
                self.friction[lane] = pair.friction;
                self.dashpot[lane] = pair.dashpot;
            }
        }
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> GrainPair {
        GrainPair {
            branch: at(&self.branch, lane),
            v: at(&self.v, lane),
            spin: at(&self.spin, lane),
            spin_to: at(&self.spin_to, lane),
            old: History { tangential: TangentialHistory { force: at(&self.old_force, lane) }, ..History::default() },
            radius: self.radius[lane],
            radius_to: self.radius_to[lane],
            radii_rest: self.radii_rest[lane],
            inverse_mass: self.inverse_mass[lane],
            inverse_mass_to: 0.0,
            materials: 0,
            pair: Pair {
                stiffness: self.stiffness[lane],
                tangential_stiffness: self.tangential_stiffness[lane],
                friction: self.friction[lane],
                dashpot: self.dashpot[lane],
            },
        }
    }
}
