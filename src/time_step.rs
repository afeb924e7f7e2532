//! Bound of the time step: Δt < 2/ω_max of the explicit leapfrog, from contact stiffness, mass and inertia.

use crate::{
    error::{Error, Result},
    laws::{dashpot::damping_ratio, dimension::inverse_gyration},
    model::Dimension,
    scene::{Assembly, Dashpot, Pair, TimeStep},
};
use std::f64::consts::PI;

/// Most neighbours of equal size that can touch a grain at once, and how much of the stiffness of that many contacts
/// can act along one normal direction, one tangential direction and one axis of rotation.
struct Coordination {
    contacts: f64,
    normal: f64,
    tangential: f64,
    rotational: f64,
}

/// Six disks around a disk: Σ n⊗n = 3 in every direction, and all six resist rotation.
const PLANE: Coordination = Coordination { contacts: 6.0, normal: 3.0, tangential: 3.0, rotational: 6.0 };
/// Twelve spheres around a sphere: 4 in every direction in close packings, at most 4.5 in any arrangement.
const SPACE: Coordination = Coordination { contacts: 12.0, normal: 4.5, tangential: 9.0, rotational: 9.0 };

/// Mass of a grain: ρ π R² per unit thickness, or ρ 4/3 π R³, kg.
pub fn mass(dimension: Dimension, density: f64, radius: f64) -> f64 {
    match dimension {
        Dimension::Plane => density * PI * radius * radius,
        Dimension::Space => density * 4.0 / 3.0 * PI * radius.powi(3),
    }
}

/// The bound, s: the smallest over all free grains. Infinite if nothing can touch.
///
/// For each grain ω² is bounded by twice the stiffness that its contacts can put into one direction, over its mass,
/// plus twice the tangential stiffness over its inertia (k_T R²/J); the factor two is the part of the other grain, and
/// falls away for walls. A grain can have no more contacts than the scene has other grains and walls. A dashpot acts
/// on velocities half a step old, which turns `ω²Δt² < 4` into `ω²Δt² + 2γΔt < 4`.
pub fn bound(assembly: &Assembly) -> f64 {
    let dimension = if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space };
    let materials = assembly.materials.len();
    let pairs_of = |material: u32| &assembly.pairs[material as usize * materials..][..materials];
    let others = (assembly.grains.len() - 1) as f64;
    let walls = assembly.walls.len() as f64;
    let coordination = if dimension == Dimension::Plane { PLANE } else { SPACE };
    let free = assembly.grains.iter().filter(|g| !g.fixed);
    free.map(|grain| {
        let m = mass(dimension, assembly.materials[grain.material as usize].density, grain.radius);
        let of_pair = |pair| of_contact(&coordination, pair, others, walls, m, inverse_gyration(dimension));
        pairs_of(grain.material).iter().map(of_pair).fold(f64::INFINITY, f64::min)
    })
    .fold(f64::INFINITY, f64::min)
}

fn of_contact(c: &Coordination, pair: &Pair, others: f64, walls: f64, mass: f64, inverse_gyration: f64) -> f64 {
    let share = |cap: f64| (2.0 * others.min(cap) + walls.min(cap)).min(2.0 * cap);
    let tangential = if pair.friction > 0.0 { pair.tangential_stiffness } else { 0.0 };
    let omega_squared = (share(c.normal) * pair.normal_stiffness
        + share(c.tangential) * tangential
        + share(c.rotational) * tangential * inverse_gyration)
        / mass;
    if omega_squared == 0.0 {
        return f64::INFINITY;
    }
    let per_contact = match pair.dashpot {
        Dashpot::None => 0.0,
        Dashpot::MassScaled(eta) => eta,
        Dashpot::Restitution(e) => 2.0 * damping_ratio(e) * (2.0 * pair.normal_stiffness / mass).sqrt(),
    };
    let gamma = (others + walls).min(c.contacts).min(c.normal) * per_contact;
    (-gamma + (gamma * gamma + 4.0 * omega_squared).sqrt()) / omega_squared
}

/// The time step to use, and its bound, s.
///
/// # Errors
/// [`Error::Scene`] if the scene asks for more than the bound without `allow_unstable`.
pub fn choose(assembly: &Assembly) -> Result<(f64, f64)> {
    let bound = bound(assembly);
    match assembly.solver.dt {
        TimeStep::Auto { fraction } if bound.is_finite() => Ok((fraction * bound, bound)),
        // Nothing can touch: any step is stable, and a thousandth of the run resolves free flight exactly.
        TimeStep::Auto { .. } => match assembly.stop.time {
            Some(time) => Ok((time / 1000.0, bound)),
            None => Err(Error::Scene(
                "solver.dt = \"auto\": nothing in this scene can touch, so there is no bound; give solver.dt or stop.time"
                    .to_owned(),
            )),
        },
        TimeStep::Fixed(dt) if dt > bound && !assembly.solver.allow_unstable => Err(Error::Scene(format!(
            "solver.dt = {dt:e} s is above the stability bound of {bound:e} s; use \"auto\" or a smaller number, or set \
             solver.allow_unstable = true"
        ))),
        TimeStep::Fixed(dt) => Ok((dt, bound)),
    }
}
