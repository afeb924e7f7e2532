//! Twin of `shaders/contact/law.wgsl`: the law of contact of the discrete element method. Its sub-models are slots:
//! normal, damping, tangential, rolling, cohesion. Each gets the state of the contact and what it remembers of it.

use super::{
    cohesion::{self, cohesive_energy, cohesive_force, is_active, overlaps},
    damping::damping_force,
    geometry::{Separation, branch_vector, is_deep, lengthened, near, sphere_separation, unit_or},
    growth::{growth_power, growth_rate_of, past_growth},
    history::{History, history_of},
    materials::{pair_index, pair_of},
    normal::{self, Loading, normal_energy, normal_force, normal_stiffness},
    rolling::{self, RollingHistory, rolling_contact, rolling_energy, with_couple},
    state::{ContactState, Law},
    tangential::{self, TangentialHistory, tangential_contact, tangential_energy},
    twist::twist_of,
};
use crate::{
    body::{
        Body,
        bodies::body,
        rotation::{inverse_rolling_inertia, surface_velocity},
    },
    model::{Growth, Normal},
    scene,
    space::{
        boundary::past_flow,
        dimension::{moment, spin_dot},
        turning::{relative_to_wall, wall_normal_before, wall_velocity},
        walls::wall_separation,
    },
    state::{ACTIVE, Pair, State},
};
use glam::DVec3;

/// The largest slopes of what a contact does, for the bound of the time step.
#[derive(Clone, Copy, Debug)]
pub struct LargestStiffness {
    /// N/m
    pub normal: f64,
    /// N/m
    pub tangential: f64,
    /// N m
    pub rolling: f64,
}

impl LargestStiffness {
    /// Of a pair of materials under this loading.
    pub fn of(pair: &scene::Pair, loading: &Loading) -> LargestStiffness {
        LargestStiffness {
            normal: normal::largest_stiffness(pair, loading) + cohesion::largest_stiffness(pair, loading),
            tangential: tangential::largest_stiffness(pair, loading),
            rolling: rolling::largest_stiffness(pair, loading),
        }
    }
}

/// A contact, seen from the grain of interest.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    /// m
    pub gap: f64,
    /// If not, nothing below means anything.
    pub is_active: bool,
    /// The surfaces overlap by more than `deep_overlap`.
    pub is_deep: bool,
    /// N, on the grain of interest.
    pub force: DVec3,
    /// m, from its centre to the contact point.
    pub arm: DVec3,
    /// m, from its centre to that of the other grain.
    pub branch: DVec3,
    /// N m, about its centre: of the force, and the couple of rolling resistance.
    pub torque: DVec3,
    /// N m, on the other grain about its own centre; a wall has none.
    pub torque_to: DVec3,
    /// N, the part of the force that is the normal dashpot's.
    pub damping: DVec3,
    /// N m, the part of the couple that is the rolling dashpot's.
    pub couple_damping: DVec3,
    /// W, dissipation of dashpots.
    pub dashpot: f64,
    /// W, that of sliding and plastic rolling since a step ago.
    pub sliding: f64,
    /// J, stored.
    pub energy: f64,
    pub history: History,
}

/// What two surfaces in contact do to the first of the two.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactForce {
    /// N
    pub force: DVec3,
    /// N m
    pub couple: DVec3,
    /// N, the part of the force that is the normal dashpot's.
    pub damping: DVec3,
    /// N m, the part of the couple that is the rolling dashpot's.
    pub couple_damping: DVec3,
    /// W, dissipation of dashpots.
    pub dashpot: f64,
    /// W, that of sliding and plastic rolling since a step ago.
    pub sliding: f64,
    /// J, stored.
    pub energy: f64,
    pub history: History,
}

#[inline(always)]
pub fn contact_force(law: Law, pair: &Pair, c: &ContactState, old: History) -> ContactForce {
    if !overlaps(law, c.gap) {
        return ContactForce {
            force: cohesive_force(law, c) * c.n,
            energy: cohesive_energy(law, c),
            ..ContactForce::default()
        };
    }
    let approach = c.v.dot(c.n);
    let stiffness = normal_stiffness(law.normal, pair, c);
    let damping = damping_force(law.damping, pair, approach, c.inverse_mass, stiffness);
    let normal = normal_force(law.normal, pair, c) + damping;
    let tangential = tangential_contact(law, pair, c, normal, old.tangential);
    let rolling = rolling_contact(law, c, stiffness, normal, old.rolling);
    let history = History { tangential: tangential.history, rolling: rolling.history };
    ContactForce {
        force: tangential.force - (normal - cohesive_force(law, c)) * c.n,
        couple: rolling.couple,
        damping: -damping * c.n,
        couple_damping: rolling.damping,
        dashpot: damping * approach + rolling.dashpot,
        sliding: tangential.dissipation + rolling.plastic,
        energy: normal_energy(law.normal, pair, c) + cohesive_energy(law, c) + stored_energy(law, pair, c, history),
        history,
    }
}

/// Energy of what a contact remembers, J; of the stiffness that the surfaces have at `c.gap`.
#[inline(always)]
fn stored_energy(law: Law, pair: &Pair, c: &ContactState, history: History) -> f64 {
    let stiffness = normal_stiffness(law.normal, pair, c);
    tangential_energy(law, pair, c, history.tangential) + rolling_energy(law, c, stiffness, history.rolling)
}

/// All that the contact of two grains depends on, seen from one of them.
#[derive(Clone, Copy, Debug, Default)]
pub struct GrainPair {
    /// m, to the centre of the other; never zero.
    pub branch: DVec3,
    /// m/s, relative to the other, with what radii grow by.
    pub v: DVec3,
    /// rad/s, its own and the other's.
    pub spin: DVec3,
    pub spin_to: DVec3,
    /// What they remember of a step ago.
    pub old: History,
    /// m, its own and the other's, and what single precision leaves out of both.
    pub radius: f64,
    pub radius_to: f64,
    pub radii_rest: f64,
    /// 1/s, how fast these radii grow, over themselves.
    pub growth: f64,
    pub growth_to: f64,
    /// 1/kg
    pub inverse_mass: f64,
    pub inverse_mass_to: f64,
    pub pair: Pair,
    /// Where their pair of materials is in tables of pairs.
    pub materials: usize,
}

impl GrainPair {
    /// How fast the surfaces move away from the centres, both together, m/s.
    #[inline(always)]
    pub fn surface_growth(&self) -> f64 {
        self.growth * self.radius + self.growth_to * self.radius_to
    }

    /// Work of growth on what the contact holds, with this force on the first, per time, W.
    pub fn growth_power(&self, normal: Normal, force: DVec3) -> f64 {
        let GrainPair { growth, growth_to, radius, radius_to, branch, .. } = *self;
        let Separation { gap, .. } = sphere_separation(branch, radius, radius_to, self.radii_rest);
        let bending = (growth * radius_to + growth_to * radius) / (radius + radius_to);
        growth_power(normal, -force.dot(branch) / branch.length(), gap, self.surface_growth(), bending)
    }

    /// The same, seen from the other.
    pub fn reversed(&self) -> GrainPair {
        let History { tangential, rolling } = self.old;
        GrainPair {
            branch: -self.branch,
            v: -self.v,
            spin: self.spin_to,
            spin_to: self.spin,
            old: History {
                tangential: TangentialHistory { force: -tangential.force },
                rolling: RollingHistory { torque: -rolling.torque },
            },
            radius: self.radius_to,
            radius_to: self.radius,
            growth: self.growth_to,
            growth_to: self.growth,
            inverse_mass: self.inverse_mass_to,
            inverse_mass_to: self.inverse_mass,
            ..*self
        }
    }
}

/// Grain j seen from grain i.
#[inline(always)]
pub fn grain_pair(s: &State, i: usize, here: &Body, j: usize, old: History) -> GrainPair {
    let (there, branch) = (body(s, j), branch_vector(s, i, j));
    let mut pair = GrainPair {
        branch,
        v: past_flow(s, s.model.boundary, here.velocity.v - there.velocity.v, branch),
        spin: here.spin,
        spin_to: there.spin,
        old,
        radius: here.position.radius,
        radius_to: there.position.radius,
        radii_rest: here.low.radius + there.low.radius,
        growth: growth_rate_of(s, i),
        growth_to: growth_rate_of(s, j),
        inverse_mass: here.velocity.inverse_mass,
        inverse_mass_to: there.velocity.inverse_mass,
        pair: pair_of(s, i, j),
        materials: pair_index(s, i, j),
    };
    if s.model.growth == Growth::Some {
        pair.v = past_growth(pair.v, branch, pair.surface_growth());
    }
    pair
}

/// From the centres of two grains to the point of contact, m.
struct Arms {
    arm: DVec3,
    arm_to: DVec3,
}

/// Erratum E7: one shared point, mid-overlap.
#[inline(always)]
fn arms(m: &GrainPair, Separation { gap, n }: Separation) -> Arms {
    Arms { arm: (m.radius + 0.5 * gap) * n, arm_to: -(m.radius_to + 0.5 * gap) * n }
}

/// What the laws are told of two grains.
#[inline(always)]
fn grain_state(law: Law, m: &GrainPair, separation: Separation) -> ContactState {
    let Separation { gap, n } = separation;
    let Arms { arm, arm_to } = arms(m, separation);
    let inertia =
        |radius: f64, inverse_mass: f64| inverse_rolling_inertia(law.rotation, law.dimension, radius, inverse_mass);
    ContactState {
        gap,
        opening: -lengthened(m.branch, law.history_dt * m.v),
        n,
        n_before: unit_or(m.branch + law.history_dt * m.v, n),
        twist: twist_of(law, n, m.spin + m.spin_to),
        v: m.v + (surface_velocity(m.spin, arm) - surface_velocity(m.spin_to, arm_to)),
        spin: m.spin - m.spin_to,
        inverse_mass: m.inverse_mass + m.inverse_mass_to,
        radius: m.radius * m.radius_to / (m.radius + m.radius_to),
        inverse_rolling_inertia: inertia(m.radius, m.inverse_mass) + inertia(m.radius_to, m.inverse_mass_to),
        materials: m.materials,
    }
}

/// The contact of two grains. It has no branches, so that many can be computed at a time. (On a device both grains
/// compute it from the same side, so that the results are opposite to the last bit; here they are anyway, because f64
/// in Rust is not reordered.)
#[inline(always)]
pub fn grain_contact(law: Law, m: &GrainPair, was_active: bool) -> Contact {
    let separation = sphere_separation(m.branch, m.radius, m.radius_to, m.radii_rest);
    let active = is_active(law, m.materials, separation.gap, was_active);
    let c = grain_state(law, m, separation);
    let Arms { arm, arm_to } = arms(m, separation);
    let f = contact_force(law, &m.pair, &c, m.old);
    let torque_to = with_couple(law, moment(arm_to, -f.force), -f.couple);
    let is_deep = is_deep(law.state, separation.gap, m.radius.min(m.radius_to));
    Contact { torque_to, is_deep, branch: m.branch, ..seen(law, arm, active, separation.gap, f) }
}

/// What the laws are told of grain i and wall w.
#[inline(always)]
fn wall_state(law: Law, i: usize, here: &Body, w: usize, separation: Separation) -> ContactState {
    let (s, wall, Separation { gap, n }) = (law.state, &law.state.wall[w], separation);
    let (radius, inverse_mass) = (here.position.radius, here.velocity.inverse_mass);
    let arm = (radius + 0.5 * gap) * n;
    let mut v = here.velocity.v - wall_velocity(s, wall, here.position.x + arm);
    if s.model.growth == Growth::Some {
        v += growth_rate_of(s, i) * radius * n;
    }
    let spin = relative_to_wall(s, here.spin, wall);
    ContactState {
        gap,
        opening: -law.history_dt * v.dot(n),
        n,
        n_before: wall_normal_before(s, wall, here.position.x - law.history_dt * here.velocity.v),
        v: v + surface_velocity(here.spin, arm),
        twist: twist_of(law, n, here.spin + (here.spin - spin)),
        spin,
        inverse_mass,
        radius,
        inverse_rolling_inertia: inverse_rolling_inertia(law.rotation, law.dimension, radius, inverse_mass),
        materials: pair_index(s, i, s.sizes.bodies + w),
    }
}

/// The contact of grain i with wall w, which remembers `old`.
#[inline(always)]
pub fn wall_contact(s: &State, i: usize, here: &Body, w: usize, was_active: bool, old: History) -> Contact {
    let separation = wall_separation(&s.wall[w], &here.position, here.low);
    let (law, other) = (Law::of(s), s.sizes.bodies + w);
    if !is_active(law, pair_index(s, i, other), separation.gap, was_active) {
        return Contact { gap: separation.gap, ..Contact::default() };
    }
    let arm = (here.position.radius + 0.5 * separation.gap) * separation.n;
    let c = wall_state(law, i, here, w, separation);
    let is_deep = is_deep(s, separation.gap, here.position.radius);
    Contact { is_deep, ..seen(law, arm, true, separation.gap, contact_force(law, &pair_of(s, i, other), &c, old)) }
}

#[inline(always)]
fn seen(law: Law, arm: DVec3, active: bool, gap: f64, f: ContactForce) -> Contact {
    Contact {
        gap,
        is_active: active,
        is_deep: false,
        force: f.force,
        arm,
        branch: DVec3::ZERO,
        torque: with_couple(law, moment(arm, f.force), f.couple),
        torque_to: DVec3::ZERO,
        damping: f.damping,
        couple_damping: f.couple_damping,
        dashpot: f.dashpot,
        sliding: f.sliding,
        energy: f.energy,
        history: f.history,
    }
}

/// The contact of grain i with neighbour j at an entry of its list.
pub fn contact_of(s: &State, i: usize, here: &Body, j: usize, entry: usize) -> Contact {
    let (old, was_active) = (history_of(s, entry), s.neighbour[entry] & ACTIVE != 0);
    match j.checked_sub(s.sizes.bodies) {
        None => grain_contact(Law::of(s), &grain_pair(s, i, here, j, old), was_active),
        Some(w) => wall_contact(s, i, here, w, was_active, old),
    }
}

/// The contact of grain i with neighbour j, which may be a wall and, if it is a grain, may be too far away to act.
#[inline(always)]
pub fn contact_with(s: &State, i: usize, here: &Body, j: usize, was_active: bool, old: History) -> Contact {
    match j.checked_sub(s.sizes.bodies) {
        None if near(s, &here.position, j) => grain_contact(Law::of(s), &grain_pair(s, i, here, j, old), was_active),
        None => Contact::default(),
        Some(w) => wall_contact(s, i, here, w, was_active, old),
    }
}

/// Energy, J, of what a contact of grain i with neighbour j that has opened still remembers, and the next step forgets.
pub fn forgotten_energy(s: &State, i: usize, here: &Body, j: usize, old: History) -> f64 {
    let law = Law::of(s);
    match j.checked_sub(s.sizes.bodies) {
        None => energy_forgotten_by_grains(law, &grain_pair(s, i, here, j, old)),
        Some(w) => {
            let c = wall_state(law, i, here, w, wall_separation(&s.wall[w], &here.position, here.low));
            energy_before(law, &pair_of(s, i, j), &c, old)
        }
    }
}

/// The same of two grains.
pub fn energy_forgotten_by_grains(law: Law, m: &GrainPair) -> f64 {
    let separation = sphere_separation(m.branch, m.radius, m.radius_to, m.radii_rest);
    energy_before(law, &m.pair, &grain_state(law, m, separation), m.old)
}

/// Of springs as they were a step ago, J, less the work that they, who still pulled then, have done by half of their
/// force.
fn energy_before(law: Law, pair: &Pair, c: &ContactState, old: History) -> f64 {
    let power = old.tangential.force.dot(c.v) + spin_dot(old.rolling.torque, c.spin);
    let before = ContactState { gap: c.gap - c.opening, ..*c };
    stored_energy(law, pair, &before, old) - 0.5 * law.history_dt * power
}
