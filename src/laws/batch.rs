//! The law of grain contacts for many at a time: the same function, on arrays that the compiler turns into vectors. On a
//! device every lane of a vector is an invocation, and WGSL has nothing like this.

use super::contact::{Contact, Gathered, Law, Meeting, grain_contact};
use crate::{model::{Dashpot, Friction}, state::Pair};
use glam::DVec3;
use pulp::{Arch, Simd, WithSimd};

/// Contacts computed at a time.
pub const LANES: usize = 64;

/// Meetings of grains, number by number, and what comes of them.
pub struct Batch {
    meetings: [[f64; LANES]; 23],
    contacts: [[f64; LANES]; 10],
}

/// What a step keeps of a contact.
pub struct Outcome {
    pub gap: f64,
    pub spring: DVec3,
    pub sum: Gathered,
}

impl Batch {
    pub fn new() -> Batch {
        Batch { meetings: [[1.0; LANES]; 23], contacts: [[0.0; LANES]; 10] }
    }

    /// Take a meeting into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, m: &Meeting) {
        let [w, v, a, b, f, p] = [&m.way, &m.v, &m.spin, &m.spin_to, &m.old, &DVec3::ZERO];
        let _ = p;
        let numbers = [
            w.x, w.y, w.z, v.x, v.y, v.z, a.x, a.y, a.z, b.x, b.y, b.z, f.x, f.y, f.z,
            m.radius, m.radius_to, m.radii_rest, m.inverse_mass,
            m.pair.stiffness, m.pair.tangential_stiffness, m.pair.friction, m.pair.dashpot,
        ];
        assert!(lane < LANES);
        for (row, number) in self.meetings.iter_mut().zip(numbers) {
            row[lane] = number;
        }
    }

    #[inline(always)]
    pub fn get(&self, lane: usize) -> Outcome {
        let c = |k: usize| self.contacts[k][lane];
        let v = |k: usize| DVec3::new(c(k), c(k + 1), c(k + 2));
        Outcome { gap: c(9), spring: v(0), sum: Gathered { force: v(3), torque: v(6) } }
    }

    /// All lanes.
    pub fn compute(&mut self, law: Law) {
        Arch::new().dispatch(Compute { law, meetings: &self.meetings, contacts: &mut self.contacts });
    }
}

struct Compute<'a> {
    law: Law,
    meetings: &'a [[f64; LANES]; 23],
    contacts: &'a mut [[f64; LANES]; 10],
}

impl WithSimd for Compute<'_> {
    type Output = ();

    /// The compiler is told the law, so that it leaves out what is not asked for.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Compute { law, meetings, contacts } = self;
        let known = |dashpot, friction| Law { dashpot, friction, ..law };
        match (law.dashpot, law.friction) {
            (Dashpot::None, Friction::None) => compute(known(Dashpot::None, Friction::None), meetings, contacts),
            (Dashpot::None, Friction::Coulomb) => compute(known(Dashpot::None, Friction::Coulomb), meetings, contacts),
            (Dashpot::Restitution, Friction::None) => compute(known(Dashpot::Restitution, Friction::None), meetings, contacts),
            (Dashpot::Restitution, Friction::Coulomb) => compute(known(Dashpot::Restitution, Friction::Coulomb), meetings, contacts),
            (Dashpot::MassScaled, Friction::None) => compute(known(Dashpot::MassScaled, Friction::None), meetings, contacts),
            (Dashpot::MassScaled, Friction::Coulomb) => compute(known(Dashpot::MassScaled, Friction::Coulomb), meetings, contacts),
        }
    }
}

#[inline(always)]
fn compute(law: Law, meetings: &[[f64; LANES]; 23], contacts: &mut [[f64; LANES]; 10]) {
    for l in 0..LANES {
        let c = |k: usize| meetings[k][l];
        let v = |k: usize| DVec3::new(c(k), c(k + 1), c(k + 2));
        let meeting = Meeting {
            way: v(0),
            v: v(3),
            spin: v(6),
            spin_to: v(9),
            old: v(12),
            radius: c(15),
            radius_to: c(16),
            radii_rest: c(17),
            inverse_mass: c(18),
            pair: Pair { stiffness: c(19), tangential_stiffness: c(20), friction: c(21), dashpot: c(22) },
        };
        let contact: Contact = grain_contact(law, &meeting);
        let mut sum = Gathered::default();
        sum.add(&contact);
        let (f, t, o) = (sum.force, sum.torque, contact.spring);
        for (row, number) in contacts.iter_mut().zip([o.x, o.y, o.z, f.x, f.y, f.z, t.x, t.y, t.z, contact.gap]) {
            row[l] = number;
        }
    }
}
