//! Twin of `shaders/contact/damping/`: the normal dashpot of a contact.

use crate::{
    model::Damping,
    scene::{self, Dashpot},
    state::Pair,
};

/// Additional compressive force, N; `approach` = v · n, `inverse_mass` = 1/m_i + 1/m_j, `stiffness` is the slope of the
/// normal force, N/m.
#[inline(always)]
pub fn damping_force(law: Damping, pair: &Pair, approach: f64, inverse_mass: f64, stiffness: f64) -> f64 {
    match law {
        Damping::None => 0.0,
        Damping::Restitution => 2.0 * pair.dashpot * (stiffness / inverse_mass).sqrt() * approach,
        Damping::MassScaled => pair.dashpot / inverse_mass * approach,
    }
}

/// Damping ratio ζ of a linear spring and dashpot that rebound with restitution e: -ln e / √(π² + ln² e).
pub fn damping_ratio(restitution: f64) -> f64 {
    let l = restitution.ln();
    -l / (std::f64::consts::PI.powi(2) + l * l).sqrt()
}

/// Its parameter: a damping ratio, or a coefficient, 1/s.
pub fn parameter(pair: &scene::Pair) -> f64 {
    match pair.dashpot {
        Dashpot::None => 0.0,
        // With this ratio Hertz' force and the dashpot ζ √(m* dF/dδ) of Tsuji et al. rebound with e (Antypov & Elliott
        // 2011, EPL 94, 50004).
        Dashpot::Restitution(e) if pair.hertz.is_some() => (5.0_f64 / 6.0).sqrt() * damping_ratio(e),
        Dashpot::Restitution(e) => damping_ratio(e),
        Dashpot::MassScaled(eta) => eta,
    }
}

/// The largest coefficient of the dashpot over the mass, 1/s, of a contact of this stiffness, N/m, of two equal masses,
/// kg.
pub fn largest_rate(pair: &scene::Pair, stiffness: f64, mass: f64) -> f64 {
    match pair.dashpot {
        Dashpot::None => 0.0,
        Dashpot::MassScaled(eta) => eta,
        Dashpot::Restitution(_) => 2.0 * parameter(pair) * (2.0 * stiffness / mass).sqrt(),
    }
}
