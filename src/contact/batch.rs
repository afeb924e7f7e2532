//! The law of grain contacts, `shaders/contact/contacts.wgsl`, for many pairs of grains at a time: the same function, in
//! a loop over arrays that the compiler turns into vectors. On a device every lane of a vector is an invocation, and WGSL
//! needs nothing like this.

use crate::{
    body::{ForceTorque, rotation::spin_of},
    contact::{
        geometry::separated,
        growth::{growth_rate_of, past_growth},
        history::History,
        law::{Contact, GrainPair, grain_contact},
        rolling::RollingHistory,
        state::Law,
        tangential::TangentialHistory,
    },
};
use crate::{
    model::{Boundary, Cohesion, Damping, Growth, Normal, Rolling, Tangential, Twist},
    space::boundary::{nearest_image_of, past_flow},
    state::{Pair, Position, State, Velocity},
};
use glam::DVec3;

/// Pairs computed at a time.
pub const LANES: usize = 16;

pub type Row = [f64; LANES];
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
    /// 1/s, of its radius, over itself.
    growth: f64,
}

impl Grain {
    /// Becomes grain i; field by field, so that no copy is made on the way.
    #[inline(always)]
    pub fn set(&mut self, s: &State, i: usize) {
        self.position = s.position[i];
        self.velocity = s.velocity[i];
        self.spin = spin_of(s, i);
        self.growth = growth_rate_of(s, i);
    }
}

/// Grains that pairs can name: a power of two, so that no index is outside.
pub const MOST_GRAINS: usize = 4096;

/// Those of the first lanes, in ascending order, of which this holds. (A branch for each of them would be guessed wrong often.)
#[inline(always)]
pub fn lanes_of<const N: usize>(lanes: usize, holds: impl Fn(usize) -> bool) -> impl Iterator<Item = usize> {
    let all = (0..N).fold(0_u32, |bits, lane| bits | u32::from(holds(lane)) << lane);
    let mut left = all & ((1 << lanes) - 1);
    std::iter::from_fn(move || {
        let lane = left.trailing_zeros() as usize;
        left &= left.wrapping_sub(1);
        (lane < N).then_some(lane)
    })
}

/// Something of each grain.
pub type OfGrains<T> = [T; MOST_GRAINS];

/// Pairs of grains: the indices of the first, which has the smaller number, and of the second.
pub type Pairs = [[u16; LANES]; 2];

#[inline(always)]
pub fn index(grain: u16) -> usize {
    grain as usize % MOST_GRAINS
}

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
    growth: Row,
    growth_to: Row,
    inverse_mass: Row,
    inverse_mass_to: Row,
    stiffness: Row,
    tangential_stiffness: Row,
    friction: Row,
    dashpot: Row,
    materials: [u32; LANES],
}

/// What contacts remember, of the first of each pair; zero where a contact is open.
pub struct Springs<'a> {
    pub is_active: &'a mut [bool; LANES],
    pub force: &'a mut Rows,
    /// If the model has rolling resistance.
    pub torque: Option<&'a mut Rows>,
}

/// Pairs of grains side by side, and what is kept of their contacts.
pub struct Batch<K> {
    pairs: GrainPairs,
    pub contacts: K,
}

/// What is kept of contacts side by side.
pub trait Kept: Default {
    fn store(&mut self, lane: usize, pair: &GrainPair, contact: &Contact);
}

/// What contacts do: the force on the first grains, and the moments on both.
#[derive(Default)]
pub struct Forces {
    /// Of each lane, whether a contact has been deep, as numbers as wide as all others here.
    deep: [u64; LANES],
    force: Rows,
    torque: Rows,
    torque_to: Rows,
}

/// Nothing, if the contact is open.
#[inline(always)]
fn kept(contact: &Contact, v: DVec3) -> DVec3 {
    if contact.is_active { v } else { DVec3::ZERO }
}

impl Kept for Forces {
    #[inline(always)]
    fn store(&mut self, lane: usize, _: &GrainPair, contact: &Contact) {
        self.deep[lane] |= u64::from(contact.is_deep);
        set(&mut self.force, lane, contact.force);
        set(&mut self.torque, lane, contact.torque);
        set(&mut self.torque_to, lane, contact.torque_to);
    }
}

impl Forces {
    /// Whether any of them has been deep.
    pub fn deep(&self) -> bool {
        self.deep.iter().fold(0, |any, deep| any | deep) != 0
    }

    /// What the first grains of the lanes get, and what the second get.
    #[inline(always)]
    pub fn add(&self, pairs: &Pairs, lanes: usize, is_active: &[bool; LANES], sums: &mut OfGrains<ForceTorque>) {
        for lane in lanes_of::<LANES>(lanes, |lane| is_active[lane]) {
            let force = at(&self.force, lane);
            let first = &mut sums[index(pairs[0][lane])];
            first.force += force;
            first.torque += at(&self.torque, lane);
            let second = &mut sums[index(pairs[1][lane])];
            second.force -= force;
            second.torque += at(&self.torque_to, lane);
        }
    }
}

impl<K: Kept> Batch<K> {
    /// For the contacts of a scene.
    pub fn new(s: &State) -> Batch<K> {
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
                growth: row,
                growth_to: row,
                inverse_mass: row,
                inverse_mass_to: row,
                stiffness: [stiffness; LANES],
                tangential_stiffness: [tangential_stiffness; LANES],
                friction: [friction; LANES],
                dashpot: [dashpot; LANES],
                materials: [0; LANES],
            },
            contacts: K::default(),
        }
    }

    /// The pair in a lane, with what it remembers.
    #[inline(always)]
    pub fn pair(&self, lane: usize, old: History) -> GrainPair {
        GrainPair { old, ..self.pairs.at(lane) }
    }

    /// The contacts of pairs of these grains; of many materials, these are their places in the table of pairs.
    #[inline(always)]
    pub fn compute(
        &mut self,
        s: &State,
        grains: &OfGrains<Grain>,
        pairs: &Pairs,
        materials: Option<&[u32; LANES]>,
        springs: &mut Springs,
    ) {
        self.pairs.gather(grains, pairs);
        self.pairs.take_images(s);
        if s.model.growth == Growth::Some {
            self.pairs.take_growth(grains, pairs);
        }
        if let Some(materials) = materials {
            self.pairs.fill_parameters(s, materials);
        }
        let law = Law::of(s);
        let served = law.rolling == Rolling::None && law.twist == Twist::Ignored && law.cohesion == Cohesion::None;
        let law = Law { rolling: Rolling::None, twist: Twist::Ignored, cohesion: Cohesion::None, ..law };
        // The compiler is told the choices one by one, so that the loop over the lanes has none.
        let with = |normal, tangential| Law { normal, tangential, ..law };
        match (law.normal, law.tangential) {
            (Normal::Hooke, Tangential::None) if served => {
                self.compute_damping(with(Normal::Hooke, Tangential::None), springs);
            }
            (Normal::Hooke, Tangential::Coulomb) if served => {
                self.compute_damping(with(Normal::Hooke, Tangential::Coulomb), springs);
            }
            (Normal::Hertz, Tangential::None) if served => {
                self.compute_damping(with(Normal::Hertz, Tangential::None), springs);
            }
            (Normal::Hertz, Tangential::Mindlin) if served => {
                self.compute_damping(with(Normal::Hertz, Tangential::Mindlin), springs);
            }
            _ => self.compute_one_by_one(Law::of(s), springs),
        }
    }

    #[inline(always)]
    fn compute_damping(&mut self, law: Law, Springs { is_active, force, .. }: &mut Springs) {
        match law.damping {
            Damping::None => self.compute_lanes(Law { damping: Damping::None, ..law }, is_active, force),
            Damping::Restitution => self.compute_lanes(Law { damping: Damping::Restitution, ..law }, is_active, force),
            Damping::MassScaled => self.compute_lanes(Law { damping: Damping::MassScaled, ..law }, is_active, force),
        }
    }

    #[inline(always)]
    fn compute_lanes(&mut self, law: Law, is_active: &mut [bool; LANES], force: &mut Rows) {
        for (lane, is_active) in is_active.iter_mut().enumerate() {
            let tangential = TangentialHistory { force: at(force, lane) };
            let old = History { tangential, ..History::default() };
            let pair = self.pair(lane, old);
            let contact = grain_contact(law, &pair, false);
            *is_active = contact.is_active;
            set(force, lane, kept(&contact, contact.history.tangential.force));
            self.contacts.store(lane, &pair, &contact);
        }
    }

    /// By laws that no vectors are made of: those that are not near enough to act are skipped.
    fn compute_one_by_one(&mut self, law: Law, Springs { is_active, force, torque }: &mut Springs) {
        for lane in 0..LANES {
            let tangential = TangentialHistory { force: at(force, lane) };
            let rolling = RollingHistory { torque: torque.as_deref().map_or(DVec3::ZERO, |torque| at(torque, lane)) };
            let pair = self.pair(lane, History { tangential, rolling });
            let reach = pair.radius + pair.radius_to + law.state.params.reach;
            let near = pair.branch.length_squared() < reach * reach;
            let contact = if near { grain_contact(law, &pair, is_active[lane]) } else { Contact::default() };
            is_active[lane] = contact.is_active;
            set(force, lane, kept(&contact, contact.history.tangential.force));
            if let Some(torque) = torque {
                set(torque, lane, kept(&contact, contact.history.rolling.torque));
            }
            self.contacts.store(lane, &pair, &contact);
        }
    }
}

impl GrainPairs {
    /// What the law asks of these grains, two lanes at a time. Not for the vectors that machines have: what these have to
    /// gather numbers from many places takes longer than to load them one by one.
    #[inline(never)]
    fn gather(&mut self, grains: &OfGrains<Grain>, [first, second]: &Pairs) {
        for begin in (0..LANES).step_by(2) {
            let of = |indices: &[u16; LANES]| [0, 1].map(|k| &grains[index(indices[begin + k])]);
            let (a, b) = (of(first), of(second));
            put_all(&mut self.branch, begin, [0, 1].map(|k| b[k].position.x - a[k].position.x));
            put_all(&mut self.v, begin, [0, 1].map(|k| a[k].velocity.v - b[k].velocity.v));
            put_all(&mut self.spin, begin, a.map(|grain| grain.spin));
            put_all(&mut self.spin_to, begin, b.map(|grain| grain.spin));
            put(&mut self.radius, begin, a.map(|grain| grain.position.radius));
            put(&mut self.radius_to, begin, b.map(|grain| grain.position.radius));
            put(&mut self.inverse_mass, begin, a.map(|grain| grain.velocity.inverse_mass));
            put(&mut self.inverse_mass_to, begin, b.map(|grain| grain.velocity.inverse_mass));
        }
    }

    /// From grain to grain.
    #[inline(always)]
    fn take_images(&mut self, s: &State) {
        match s.model.boundary {
            Boundary::Open => {}
            Boundary::Periodic => self.take_nearest(s, Boundary::Periodic),
            Boundary::Deforming => self.take_nearest(s, Boundary::Deforming),
        }
        let coincide = |lane: usize| at(&self.branch, lane).length_squared() == 0.0;
        if (0..LANES).fold(false, |any, lane| any | coincide(lane)) {
            for lane in 0..LANES {
                let branch = at(&self.branch, lane);
                set(&mut self.branch, lane, separated(true, branch));
            }
        }
        if s.model.boundary == Boundary::Deforming {
            for lane in 0..LANES {
                let v = past_flow(s, Boundary::Deforming, at(&self.v, lane), at(&self.branch, lane));
                set(&mut self.v, lane, v);
            }
        }
    }

    /// How fast their surfaces approach as they grow.
    #[inline(always)]
    fn take_growth(&mut self, grains: &OfGrains<Grain>, [first, second]: &Pairs) {
        for lane in 0..LANES {
            self.growth[lane] = grains[index(first[lane])].growth;
            self.growth_to[lane] = grains[index(second[lane])].growth;
        }
        for lane in 0..LANES {
            let pair = self.at(lane);
            set(&mut self.v, lane, past_growth(pair.v, pair.branch, pair.surface_growth()));
        }
    }

    #[inline(always)]
    fn take_nearest(&mut self, s: &State, boundary: Boundary) {
        for lane in 0..LANES {
            let branch = at(&self.branch, lane);
            set(&mut self.branch, lane, nearest_image_of(s, boundary, branch));
        }
    }

    /// The parameters of pairs of materials, of which a table has these.
    #[inline(always)]
    fn fill_parameters(&mut self, s: &State, materials: &[u32; LANES]) {
        self.materials = *materials;
        for (lane, materials) in materials.iter().enumerate() {
            let Pair { stiffness, tangential_stiffness, friction, dashpot } = s.pair[*materials as usize];
            self.stiffness[lane] = stiffness;
            self.tangential_stiffness[lane] = tangential_stiffness;
            self.friction[lane] = friction;
            self.dashpot[lane] = dashpot;
        }
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> GrainPair {
        GrainPair {
            branch: at(&self.branch, lane),
            v: at(&self.v, lane),
            spin: at(&self.spin, lane),
            spin_to: at(&self.spin_to, lane),
            old: History::default(),
            radius: self.radius[lane],
            radius_to: self.radius_to[lane],
            radii_rest: 0.0,
            growth: self.growth[lane],
            growth_to: self.growth_to[lane],
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

/// Two lanes, in one store.
#[inline(always)]
fn put(row: &mut Row, begin: usize, values: [f64; 2]) {
    row[begin..begin + 2].copy_from_slice(&values);
}

#[inline(always)]
fn put_all([x, y, z]: &mut Rows, begin: usize, values: [DVec3; 2]) {
    put(x, begin, values.map(|v| v.x));
    put(y, begin, values.map(|v| v.y));
    put(z, begin, values.map(|v| v.z));
}
