//! Twin of `shaders/nscd/compliance/`: contacts that give way as the springs and dashpots of the discrete element method
//! do, taken implicitly: `u = (W + C) r + q` in place of `u = W r + q`. Forces are unique then (Krabbenhoft et al. 2012;
//! Castro et al. 2022), and overlaps at rest are those of the springs, whatever the time step.

use crate::{
    contact::{damping::damping_force, materials::pair_of},
    model::Compliance,
    solve::natural_map::{OrientedContact, UpdateScales},
    state::{ACTIVE, INDEX, InverseEffectiveMass, Packed, Pair, State},
};
use glam::DVec3;

/// C, 1/kg, of a contact that has this of W. The pressing force of a spring and dashpot at the end of the step is
/// `F = k (Δt u - g) + c u` of the approach u and the gap g, so that `u = F Δt / (Δt (k Δt + c)) + k g / (k Δt + c)`.
pub fn compliance_of(s: &State, pair: &Pair, inverse_mass: &InverseEffectiveMass) -> UpdateScales {
    match s.model.compliance {
        Compliance::None => UpdateScales::default(),
        Compliance::Stiffness => {
            let dt = s.params.dt;
            let normal = dt * (pair.stiffness * dt + dashpot_of(s, pair, inverse_mass));
            // Without friction nothing acts across.
            let across = if pair.friction > 0.0 { 1.0 / (dt * dt * pair.tangential_stiffness) } else { 0.0 };
            UpdateScales { normal: 1.0 / normal, tangential: across }
        }
    }
}

/// That of the contact of grain i at an entry.
pub fn compliance_at(s: &State, i: usize, entry: usize) -> UpdateScales {
    let j = (s.neighbour[entry] & INDEX) as usize;
    compliance_of(s, &pair_of(s, i, j), &s.inverse_effective_mass[entry])
}

/// Coefficient of the normal dashpot, N s/m, of the mass 1/W_nn.
fn dashpot_of(s: &State, pair: &Pair, inverse_mass: &InverseEffectiveMass) -> f64 {
    damping_force(s.model.damping, pair, 1.0, inverse_mass.normal, pair.stiffness)
}

/// The speed at which a contact begins to press. Of rigid ones that which closes a gap within the step; an overlap opens at
/// a bounded one, and gaps within rounding are none. Springs do not press where an overlap opens by what they have relaxed.
pub fn bias_velocity_of(s: &State, gap: f64, pair: &Pair, inverse_mass: &InverseEffectiveMass) -> f64 {
    let dt = s.params.dt;
    match s.model.compliance {
        Compliance::None if gap.abs() < s.params.gap_band => 0.0,
        Compliance::None if gap > 0.0 => gap / dt,
        Compliance::None => ((gap + s.params.gap_band) / dt).max(-s.params.max_correction_velocity),
        Compliance::Stiffness if gap > 0.0 => gap / dt,
        Compliance::Stiffness => {
            let yielding = pair.stiffness * dt;
            gap / dt * (yielding / (yielding + dashpot_of(s, pair, inverse_mass)))
        }
    }
}

/// What the tangential spring adds to q, m/s: it has been stretched by the steps before.
pub fn spring_velocity(s: &mut State, entry: usize, n: DVec3, compliance: &UpdateScales) -> DVec3 {
    if s.model.compliance == Compliance::None {
        return DVec3::ZERO;
    }
    if s.neighbour[entry] & ACTIVE == 0 {
        s.tangential_force[entry] = Packed(DVec3::ZERO);
    }
    -(compliance.tangential * s.params.dt) * turned(s.tangential_force[entry].0, n)
}

/// A force of a spring turned into the contact plane, of the same size.
fn turned(force: DVec3, n: DVec3) -> DVec3 {
    let flat = force - force.dot(n) * n;
    let squared = flat.length_squared();
    if squared == 0.0 { DVec3::ZERO } else { (force.length_squared() / squared).sqrt() * flat }
}

/// A step ends with the impulse that the contact at this entry has.
pub fn remember_spring(s: &mut State, entry: usize) {
    if s.model.compliance == Compliance::Stiffness {
        let (impulse, n) = (s.impulse[entry].0, s.contact_geometry[entry].n);
        s.tangential_force_next[entry] = Packed((impulse - impulse.dot(n) * n) / s.params.dt);
    }
}

/// A contact with C in its scales and C r in its velocity, at this impulse on its first side.
pub fn compliant(s: &State, side: &OrientedContact, compliance: &UpdateScales, impulse: DVec3) -> OrientedContact {
    if s.model.compliance == Compliance::None {
        return *side;
    }
    let pressed = impulse.dot(side.n) * side.n;
    let across = impulse - pressed;
    // Its rounding along n, too, or it would be as that of C, which may be far less along n than across.
    let flat = across - across.dot(side.n) * side.n;
    OrientedContact {
        normal: side.normal + compliance.normal,
        tangential: side.tangential + compliance.tangential,
        velocity: side.velocity + compliance.normal * pressed + compliance.tangential * flat,
        ..*side
    }
}

/// C times the change of an impulse, and that again, J.
pub fn compliant_work(n: DVec3, compliance: &UpdateScales, change: DVec3) -> f64 {
    let pressed = change.dot(n);
    compliance.normal * pressed * pressed + compliance.tangential * (change - pressed * n).length_squared()
}
