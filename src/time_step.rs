//! Bound of the time step: Δt < 2/ω_max of the explicit leapfrog, from contact stiffness, mass and inertia.

use crate::{
    error::{Error, Result},
    laws::{dashpot::damping_ratio, dimension::inverse_gyration},
    model::Dimension,
    scene::{Assembly, Dashpot, Grain, Method, Pair, Surface, TimeStep, Wall},
};
use glam::DVec3;
use std::f64::consts::PI;

/// How many grains of the smallest size can touch a grain at once, and how much of the stiffness of that many contacts
/// can act along one normal direction, one tangential direction and about one axis.
struct Coordination {
    contacts: f64,
    normal: f64,
    tangential: f64,
    rotational: f64,
}

impl Coordination {
    /// Around a grain of radius `own`, the smallest other one being `other`.
    fn new(dimension: Dimension, own: f64, other: f64) -> Coordination {
        let ratio = own / other;
        match dimension {
            // As many disks as subtend the full angle; every one resists rotation. Six equal ones: 3, 3 and 6.
            Dimension::Plane => {
                let contacts = (PI / (1.0 / (1.0 + ratio)).asin()).max(3.0);
                Coordination { contacts, normal: contacts / 2.0, tangential: contacts / 2.0, rotational: contacts }
            }
            // Caps of the small spheres cover at most 0.9069 of the sphere through their centres. Of equal ones there
            // can be 12, with 4 along every direction in close packings and at most 4.5 in any arrangement.
            Dimension::Space => {
                let contacts = if ratio <= 1.0 { 12.0 } else { (0.9069 * 4.0 * (1.0 + ratio).powi(2)).max(12.0) };
                let (normal, sideways) = ((contacts / 3.0).max(4.5), (2.0 * contacts / 3.0).max(9.0));
                Coordination { contacts, normal, tangential: sideways, rotational: sideways }
            }
        }
    }
}

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
/// falls away for walls. A grain can have no more contacts than the scene has other grains and walls, nor than fit
/// around it without overlap. A dashpot acts on velocities half a step old, which turns `ω²Δt² < 4` into
/// `ω²Δt² + 2γΔt < 4`. Grains that overlap each other by much, fixed ones above all, can exceed the contacts counted
/// here.
pub fn bound(assembly: &Assembly) -> f64 {
    let dimension = dimension(assembly);
    let others = (assembly.grains.len() - 1) as f64;
    let walls = assembly.walls.len() as f64;
    let smallest = assembly.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    let of_grain = |(grain, mass): (&Grain, f64), pair: &Pair| {
        let coordination = Coordination::new(dimension, grain.radius, smallest);
        of_contact(&coordination, pair, others, walls, mass, inverse_gyration(dimension))
    };
    smallest_over_contacts(assembly, of_grain)
}

/// The shortest duration of a collision, π √(m*/k_N), s, between equal grains or of a grain with a wall; infinite if
/// nothing can touch.
pub fn shortest_contact(assembly: &Assembly) -> f64 {
    let share = if assembly.grains.len() > 1 { 0.5 } else { 1.0 };
    let nothing = assembly.grains.len() < 2 && assembly.walls.is_empty();
    let of_grain = |(_, mass): (&Grain, f64), pair: &Pair| PI * (share * mass / pair.normal_stiffness).sqrt();
    if nothing { f64::INFINITY } else { smallest_over_contacts(assembly, of_grain) }
}

fn dimension(assembly: &Assembly) -> Dimension {
    if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space }
}

/// The smallest value over free grains and the pairs of materials they can be part of.
fn smallest_over_contacts(assembly: &Assembly, value: impl Fn((&Grain, f64), &Pair) -> f64) -> f64 {
    let materials = assembly.materials.len();
    let mut present = vec![false; materials];
    assembly.grains.iter().map(|g| g.material).chain(assembly.walls.iter().map(|w| w.material)).for_each(|m| {
        present[m as usize] = true;
    });
    let free = assembly.grains.iter().filter(|g| !g.fixed);
    free.map(|grain| {
        let m = mass(dimension(assembly), assembly.materials[grain.material as usize].density, grain.radius);
        let pairs = &assembly.pairs[grain.material as usize * materials..][..materials];
        let possible = pairs.iter().zip(&present).filter(|(_, present)| **present);
        possible.map(|(pair, _)| value((grain, m), pair)).fold(f64::INFINITY, f64::min)
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

/// The step in which the fastest grain, after falling all the time, moves a quarter of the lists' margin.
fn free_flight(assembly: &Assembly, time: f64) -> f64 {
    let fastest = assembly.grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
    let radius = assembly.grains.iter().map(|g| g.radius).sum::<f64>() / assembly.grains.len() as f64;
    0.25 * assembly.solver.margin * radius / (fastest + assembly.gravity.length() * time)
}

/// The step of rigid grains, which nothing bounds but what is seen of them: the smallest grain takes 20 steps to fall by its
/// diameter, and none goes further than a quarter of what it may, even after falling from the top of the scene to its bottom.
///
/// # Errors
/// [`Error::Scene`] if nothing moves.
fn rigid_step(assembly: &Assembly) -> Result<f64> {
    let grains = &assembly.grains;
    let g = assembly.gravity.length();
    let smallest = grains.iter().map(|grain| grain.radius).fold(f64::INFINITY, f64::min);
    let mean = grains.iter().map(|grain| grain.radius).sum::<f64>() / grains.len() as f64;
    let height = |x: DVec3| if g == 0.0 { 0.0 } else { -x.dot(assembly.gravity) / g };
    let floors = assembly.walls.iter().filter_map(|wall| match wall.surface {
        Surface::Plane { point, normal } if height(normal) > 0.0 => Some(height(point)),
        _ => None,
    });
    let bottom = grains.iter().map(|grain| height(grain.position)).chain(floors).fold(f64::INFINITY, f64::min);
    let top = grains.iter().map(|grain| height(grain.position)).fold(f64::NEG_INFINITY, f64::max);
    let surface = |wall: &Wall| match wall.surface {
        Surface::Cylinder { radius, .. } => wall.velocity.length() + wall.spin.abs() * radius,
        Surface::Plane { .. } => wall.velocity.length(),
    };
    let moving = grains.iter().map(|grain| grain.velocity.length()).chain(assembly.walls.iter().map(surface));
    let fastest = moving.fold(0.0, f64::max) + (2.0 * g * (top - bottom)).sqrt();
    let fall = (4.0 * smallest / g).sqrt() / 20.0;
    let stride = 0.25 * 0.5 * smallest.min(assembly.solver.margin * mean) / fastest;
    let dt = fall.min(stride);
    if dt.is_finite() {
        return Ok(dt);
    }
    Err(Error::Scene("solver.dt = \"auto\": nothing in this scene moves or falls; give solver.dt".to_owned()))
}

/// Steps that `"auto"` gives the shortest collision at least: a stable step is not yet an accurate one.
const STEPS_PER_CONTACT: f64 = 50.0;

/// The time step to use, and its bound, s.
///
/// # Errors
/// [`Error::Scene`] if the scene asks for more than the bound without `allow_unstable`.
pub fn choose(assembly: &Assembly) -> Result<(f64, f64)> {
    let bound = bound(assembly);
    match assembly.solver.dt {
        TimeStep::Auto { .. } if assembly.solver.method != Method::DiscreteElements => Ok((rigid_step(assembly)?, bound)),
        TimeStep::Auto { fraction } if bound.is_finite() => {
            Ok(((fraction * bound).min(shortest_contact(assembly) / STEPS_PER_CONTACT), bound))
        }
        // Nothing can touch: any step is stable and exact; it must only be short enough to be followed.
        TimeStep::Auto { .. } => match assembly.stop.time {
            Some(time) => Ok(((time / 1000.0).min(free_flight(assembly, time)), bound)),
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
