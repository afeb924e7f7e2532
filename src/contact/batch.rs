//! The law of grain contacts, `shaders/contact/contacts.wgsl`, for many pairs of grains at a time: the same function, in
//! a loop over arrays that the compiler turns into vectors. On a device every lane of a vector is an invocation, and WGSL
//! needs nothing like this.

use crate::{
    body::{ForceTorque, rotation::spin_of},
    contact::{
        geometry::branch_between,
        history::History,
        law::{Contact, GrainPair, grain_contact},
        materials::material_of,
        rolling::RollingHistory,
        state::Law,
        tangential::TangentialHistory,
    },
};
use crate::{
    model::{Cohesion, Damping, Materials, Normal, Rolling, Tangential, Twist},
    state::{Pair, Position, State, Velocity},
};
use glam::DVec3;

/// Pairs computed at a time.
pub const LANES: usize = 16;

type Row = [f64; LANES];
/// Vectors, component by component.
pub type Rows = [Row; 3];

/// Nothing in any lane.
pub const ZERO: Rows = [[0.0; LANES]; 3];

/// What contacts ask of a grain, in one place; in double precision.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub struct Grain {
    position: Position,
    velocity: Velocity,
    spin: DVec3,
    id: u32,
    /// Zero if there is one material only.
    material: u32,
}

impl Grain {
    #[inline(always)]
    pub fn of(s: &State, i: usize) -> Grain {
        let material = if s.model.materials == Materials::Many { material_of(s, i) as u32 } else { 0 };
        Grain { position: s.position[i], velocity: s.velocity[i], spin: spin_of(s, i), id: s.id[i], material }
    }
}

/// The lanes of pairs of grains: the indices of the first and of the second of each among some grains.
pub type Pairs = [[u32; LANES]; 2];

#[inline(always)]
pub fn at(rows: &Rows, lane: usize) -> DVec3 {
    DVec3::new(rows[0][lane], rows[1][lane], rows[2][lane])
}

#[inline(always)]
pub fn set(rows: &mut Rows, lane: usize, v: DVec3) {
    (rows[0][lane], rows[1][lane], rows[2][lane]) = (v.x, v.y, v.z);
}

/// Pairs of grains, number by number, as the first of each sees the second.
struct GrainPairs {
    branch: Rows,
    v: Rows,
    spin: Rows,
    spin_to: Rows,
    radius: Row,
    radius_to: Row,
    inverse_mass: Row,
    inverse_mass_to: Row,
    stiffness: Row,
    tangential_stiffness: Row,
    friction: Row,
    dashpot: Row,
    materials: [u32; LANES],
}

/// What contacts remember, of the first of each pair; zero where a contact is open.
#[derive(Clone, Copy, Debug)]
pub struct Springs {
    pub is_active: [bool; LANES],
    pub force: Rows,
    pub torque: Rows,
}

impl Springs {
    pub const NONE: Springs = Springs { is_active: [false; LANES], force: ZERO, torque: ZERO };

    #[inline(always)]
    pub fn history(&self, lane: usize) -> History {
        History {
            tangential: TangentialHistory { force: at(&self.force, lane) },
            rolling: RollingHistory { torque: at(&self.torque, lane) },
        }
    }

    #[inline(always)]
    pub fn set_history(&mut self, lane: usize, history: &History) {
        set(&mut self.force, lane, history.tangential.force);
        set(&mut self.torque, lane, history.rolling.torque);
    }
}

/// Pairs of grains side by side, and what comes of them.
pub struct Batch {
    pairs: GrainPairs,
    /// Before and after.
    pub springs: Springs,
    force: Rows,
    torque: Rows,
    torque_to: Rows,
}

impl Batch {
    /// For the contacts of a scene.
    pub fn new(s: &State) -> Batch {
        let row = [0.0; LANES];
        let Pair { stiffness, tangential_stiffness, friction, dashpot } = s.params.pair;
        Batch {
            pairs: GrainPairs {
                branch: ZERO,
                v: ZERO,
                spin: ZERO,
                spin_to: ZERO,
                radius: row,
                radius_to: row,
                inverse_mass: row,
                inverse_mass_to: row,
                stiffness: [stiffness; LANES],
                tangential_stiffness: [tangential_stiffness; LANES],
                friction: [friction; LANES],
                dashpot: [dashpot; LANES],
                materials: [0; LANES],
            },
            springs: Springs::NONE,
            force: ZERO,
            torque: ZERO,
            torque_to: ZERO,
        }
    }

    /// The contacts of pairs of these grains.
    #[inline(always)]
    pub fn compute(&mut self, s: &State, grains: &[Grain], pairs: &Pairs) {
        self.pairs.fill(s, grains, pairs);
        let law = Law::of(s);
        let linear = law.normal == Normal::Hooke
            && matches!(law.tangential, Tangential::None | Tangential::Coulomb)
            && law.rolling == Rolling::None
            && law.twist == Twist::Ignored
            && law.cohesion == Cohesion::None;
        if !linear {
            return self.compute_one_by_one(law);
        }
        let law = Law {
            normal: Normal::Hooke,
            rolling: Rolling::None,
            twist: Twist::Ignored,
            cohesion: Cohesion::None,
            ..law
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
        for lane in 0..LANES {
            let contact = grain_contact(law, &self.pairs.at(lane, self.springs.history(lane)), false);
            self.store(lane, &contact);
        }
    }

    /// By laws that no vectors are made of: those that are not near enough to act are skipped.
    fn compute_one_by_one(&mut self, law: Law) {
        for lane in 0..LANES {
            let pair = self.pairs.at(lane, self.springs.history(lane));
            let reach = pair.radius + pair.radius_to + law.state.params.reach;
            let near = pair.branch.length_squared() < reach * reach;
            let contact =
                if near { grain_contact(law, &pair, self.springs.is_active[lane]) } else { Contact::default() };
            self.store(lane, &contact);
        }
    }

    #[inline(always)]
    fn store(&mut self, lane: usize, contact: &Contact) {
        let kept = |v: DVec3| if contact.is_active { v } else { DVec3::ZERO };
        self.springs.is_active[lane] = contact.is_active;
        set(&mut self.springs.force, lane, kept(contact.history.tangential.force));
        set(&mut self.springs.torque, lane, kept(contact.history.rolling.torque));
        set(&mut self.force, lane, kept(contact.force));
        set(&mut self.torque, lane, kept(contact.torque));
        set(&mut self.torque_to, lane, kept(contact.torque_to));
    }

    /// What the first grains of the lanes get, and what the second get.
    #[inline(always)]
    pub fn add(&self, pairs: &Pairs, lanes: usize, sums: &mut [ForceTorque]) {
        for lane in 0..lanes {
            let force = at(&self.force, lane);
            let first = &mut sums[pairs[0][lane] as usize];
            first.force += force;
            first.torque += at(&self.torque, lane);
            let second = &mut sums[pairs[1][lane] as usize];
            second.force -= force;
            second.torque += at(&self.torque_to, lane);
        }
    }
}

impl GrainPairs {
    /// Short loops without choices in them.
    #[inline(always)]
    fn fill(&mut self, s: &State, grains: &[Grain], pairs: &Pairs) {
        for lane in 0..LANES {
            let (a, b) = (&grains[pairs[0][lane] as usize], &grains[pairs[1][lane] as usize]);
            let branch = branch_between(s, [a.position.x, b.position.x], DVec3::ZERO, [a.id, b.id]);
            set(&mut self.branch, lane, branch);
            (self.radius[lane], self.radius_to[lane]) = (a.position.radius, b.position.radius);
            set(&mut self.v, lane, a.velocity.v - b.velocity.v);
            self.inverse_mass[lane] = a.velocity.inverse_mass;
            self.inverse_mass_to[lane] = b.velocity.inverse_mass;
            set(&mut self.spin, lane, a.spin);
            set(&mut self.spin_to, lane, b.spin);
        }
        if s.model.materials == Materials::Many {
            for lane in 0..LANES {
                let (a, b) = (&grains[pairs[0][lane] as usize], &grains[pairs[1][lane] as usize]);
                let materials = a.material * s.params.materials + b.material;
                let Pair { stiffness, tangential_stiffness, friction, dashpot } = s.pair[materials as usize];
                self.stiffness[lane] = stiffness;
                self.tangential_stiffness[lane] = tangential_stiffness;
                self.friction[lane] = friction;
                self.dashpot[lane] = dashpot;
                self.materials[lane] = materials;
            }
        }
    }

    #[inline(always)]
    fn at(&self, lane: usize, old: History) -> GrainPair {
        GrainPair {
            branch: at(&self.branch, lane),
            v: at(&self.v, lane),
            spin: at(&self.spin, lane),
            spin_to: at(&self.spin_to, lane),
            old,
            radius: self.radius[lane],
            radius_to: self.radius_to[lane],
            radii_rest: 0.0,
            inverse_mass: self.inverse_mass[lane],
            inverse_mass_to: self.inverse_mass_to[lane],
            materials: self.materials[lane] as usize,
            pair: Pair {
                stiffness: self.stiffness[lane],
                tangential_stiffness: self.tangential_stiffness[lane],
                friction: self.friction[lane],
                dashpot: self.dashpot[lane],
            },
        }
    }
}
