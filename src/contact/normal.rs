//! Twin of `shaders/contact/normal/`: the normal force of a contact.

use super::state::ContactState;
use crate::{
    model::Normal,
    scene::{self, Hertz},
    state::Pair,
};
use std::f64::consts::PI;

/// Pressing force, N, of an overlap.
#[inline(always)]
pub fn normal_force(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => -pair.stiffness * c.gap,
        Normal::Hertz => -4.0 / 3.0 * pair.stiffness * contact_radius(c) * c.gap,
        Normal::Rigid => 0.0,
    }
}

/// Its slope, N/m.
#[inline(always)]
pub fn normal_stiffness(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => pair.stiffness,
        Normal::Hertz => 2.0 * pair.stiffness * contact_radius(c),
        Normal::Rigid => 0.0,
    }
}

/// Energy stored in the overlap, J.
#[inline(always)]
pub fn normal_energy(law: Normal, pair: &Pair, c: &ContactState) -> f64 {
    match law {
        Normal::Hooke => 0.5 * pair.stiffness * c.gap * c.gap,
        Normal::Hertz => 8.0 / 15.0 * pair.stiffness * contact_radius(c) * c.gap * c.gap,
        Normal::Rigid => 0.0,
    }
}

/// What the energy is over force and overlap, times its power of the effective radius.
#[inline(always)]
pub fn energy_of_radius(law: Normal) -> f64 {
    if law == Normal::Hertz { 0.2 } else { 0.0 }
}

/// By what part the stiffness has fallen in this step: 1 - √(δ / δ before), at least 0. What is held by it falls as
/// much, so that no cycle of loading gains energy (Thornton, Cummins & Cleary 2013, Powder Technol. 233, 30).
#[inline(always)]
pub fn softening(law: Normal, c: &ContactState) -> f64 {
    let before = c.opening - c.gap;
    match law {
        Normal::Hertz if c.opening > 0.0 && before > 0.0 => {
            c.opening.min(before) / (before + (before * (-c.gap).max(0.0)).sqrt())
        }
        _ => 0.0,
    }
}

/// The larger stiffness of this step and the one before over the smaller, less one: what springs that hold what they
/// held, softened, lose of their energy now.
#[inline(always)]
pub fn stiffness_change(law: Normal, c: &ContactState) -> f64 {
    let before = c.opening - c.gap;
    let (smaller, larger) = ((-c.gap).min(before), (-c.gap).max(before));
    match law {
        Normal::Hertz if smaller > 0.0 => c.opening.abs() / smaller / (1.0 + (larger / smaller).sqrt()),
        _ => 0.0,
    }
}

/// Radius of the contact area of elastic spheres, m: √(R* δ).
#[inline(always)]
pub fn contact_radius(c: &ContactState) -> f64 {
    (c.radius * (-c.gap).max(0.0)).sqrt()
}

/// What a contact has to bear, for bounds of the time step.
#[derive(Clone, Copy, Debug)]
pub struct Loading {
    /// m, effective radius.
    pub radius: f64,
    /// kg, effective mass.
    pub mass: f64,
    /// m/s, of the fastest impact.
    pub speed: f64,
    /// N, the largest load at rest.
    pub force: f64,
    /// m, the largest overlap seen.
    pub overlap: f64,
}

/// The law's parameter: k_N, N/m, or E*, Pa.
pub fn parameter(pair: &scene::Pair) -> f64 {
    pair.hertz.map_or(pair.normal_stiffness, |h| h.youngs_modulus)
}

/// The largest slope of the normal force under this loading, N/m.
pub fn largest_stiffness(pair: &scene::Pair, loading: &Loading) -> f64 {
    pair.hertz.map_or(pair.normal_stiffness, |h| 2.0 * h.youngs_modulus * largest_contact_radius(&h, loading))
}

/// The largest radius of the contact area under this loading, m: of the fastest impact, of the largest load at rest or
/// of the overlap seen, with one of 1e-5 R* at least, so that a scene at rest without weight has a bound too.
pub fn largest_contact_radius(h: &Hertz, loading: &Loading) -> f64 {
    let Loading { radius, mass, speed, force, overlap } = *loading;
    let impact = (15.0 * mass * speed * speed / (16.0 * h.youngs_modulus * radius.sqrt())).powf(0.4);
    let rest = (3.0 * force / (4.0 * h.youngs_modulus * radius.sqrt())).powf(2.0 / 3.0);
    (radius * impact.max(rest).max(overlap).max(1e-5 * radius)).sqrt()
}

/// The largest overlap under this loading, m: of the fastest impact, on top of what the load at rest makes.
pub fn largest_overlap(pair: &scene::Pair, loading: &Loading) -> f64 {
    if let Some(h) = pair.hertz {
        return largest_contact_radius(&h, loading).powi(2) / loading.radius;
    }
    let (k, rest) = (pair.normal_stiffness, loading.force / pair.normal_stiffness);
    rest + (rest * rest + loading.mass * loading.speed * loading.speed / k).sqrt()
}

/// The duration of a collision, s: π √(m*/k_N), or of elastic spheres 2.8683 (m*² / (R* E*² v))^(1/5) (Johnson 1985,
/// eq. 11.24) of the fastest impact, or half a period of small swings under the largest stiffness, whichever is
/// shorter.
pub fn contact_duration(pair: &scene::Pair, loading: &Loading) -> f64 {
    if let Some(h) = pair.hertz {
        let Loading { radius, mass, speed, .. } = *loading;
        let impact = 2.868_265 * (mass * mass / (radius * h.youngs_modulus.powi(2) * speed)).powf(0.2);
        return impact.min(PI * (mass / largest_stiffness(pair, loading)).sqrt());
    }
    PI * (loading.mass / pair.normal_stiffness).sqrt()
}
