//! Bound of the time step: Δt < 2/ω_max of the explicit leapfrog, from contact stiffness, mass and inertia.

use crate::{
    body::rotation::inverse_rolling_inertia,
    contact::{
        damping,
        law::LargestStiffness,
        normal::{self, Loading},
        rolling,
    },
    error::{Error, Result},
    model::{Dimension, Rotation},
    scene::{Assembly, Clump, Grain, Member, Method, Pair, Surface, TimeStep, Wall},
    space::dimension::inverse_gyration,
};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::{f64::consts::PI, ops::Deref, slice};

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

/// The bound, s: the smallest over all free grains. Infinite if nothing can touch, and of contact dynamics, whose steps are
/// implicit.
///
/// For each grain ω² is bounded by twice the stiffness that its contacts can put into one direction, over its mass,
/// plus twice the tangential stiffness over its inertia (k_T R²/J) and twice the rolling stiffness over
/// it; the factor two is the part of the other grain, and falls away for walls. A grain can have no more contacts than
/// the scene has other grains and walls, nor than fit around it without overlap. A clump adds up its members, each with
/// the part of its surface that is outside of the others; a force through a member's centre moves and turns the clump.
/// A dashpot acts on velocities half a step old, which turns `ω²Δt² < 4` into `ω²Δt² + 2γΔt < 4`. Grains that overlap
/// each other by much, fixed ones above all, can exceed the contacts counted here.
pub fn bound(assembly: &Assembly) -> f64 {
    if assembly.solver.method != Method::DiscreteElements {
        return f64::INFINITY;
    }
    let worst = Worst::of(assembly);
    smallest_of_sizes(assembly, |sized| bound_under(sized, &worst))
}

/// The smallest value of a scene with the smallest and with the largest radii that its grains will have: masses and
/// stiffnesses go one way as radii grow.
fn smallest_of_sizes(assembly: &Assembly, value: impl Fn(&Assembly) -> f64) -> f64 {
    match assembly.grows() {
        true => value(&assembly.with_smallest_radii()).min(value(&assembly.with_largest_radii())),
        false => value(assembly),
    }
}

/// The overlap over the radius up to which a time step is below the bound; infinite where stiffnesses do not grow with
/// overlaps. As stiffnesses grow with its root, the bound falls with its fourth root.
pub fn stable_overlap(assembly: &Assembly, dt: f64) -> f64 {
    if assembly.pairs[0].hertz.is_none() || assembly.solver.method != Method::DiscreteElements {
        return f64::INFINITY;
    }
    let worst = Worst { speed: 0.0, load: 0.0, overlap: 1.0 };
    let full = smallest_of_sizes(assembly, |sized| bound_under(sized, &worst));
    (full / dt).powi(4)
}

/// Of the grains, whenever it is, m.
fn smallest_radius(assembly: &Assembly) -> f64 {
    smallest(&assembly.with_smallest_radii().grains, |grain| grain.radius)
}

fn bound_under(assembly: &Assembly, worst: &Worst) -> f64 {
    let walls = assembly.walls.len() as f64;
    let smallest = smallest_radius(assembly);
    let others = |own: usize| (assembly.grains.len() - own) as f64;
    smallest_over_contacts(assembly, |body, pair| {
        of_contacts(body, pair, worst, smallest, others(body.members.len()), walls)
    })
}

/// The shortest duration of a collision, s, between equal grains or of a grain with a wall; infinite if nothing can
/// touch.
pub fn shortest_contact(assembly: &Assembly) -> f64 {
    let share = if assembly.grains.len() > 1 { 0.5 } else { 1.0 };
    let nothing = assembly.grains.len() < 2 && assembly.walls.is_empty();
    let worst = Worst::of(assembly);
    let of_grain = |body: &Body, pair: &Pair| {
        let loading = Loading { mass: share * body.lightest(), ..worst.loading(body, body.members[0].radius, share) };
        normal::contact_duration(pair, &loading)
    };
    match nothing {
        true => f64::INFINITY,
        false => smallest_of_sizes(assembly, |sized| smallest_over_contacts(sized, of_grain)),
    }
}

/// The worst that contacts of a scene have to bear, as far as that can be seen before it runs.
struct Worst {
    /// m/s, of the fastest two that may meet: grains or walls, after a fall from the top of the scene to its bottom.
    speed: f64,
    /// Weight of a column of grains over that of one, m/s².
    load: f64,
    /// Over the radius, at the start.
    overlap: f64,
}

impl Worst {
    fn of(assembly: &Assembly) -> Worst {
        let height = height(assembly);
        let mean = assembly.grains.iter().map(|g| g.radius).sum::<f64>() / assembly.grains.len() as f64;
        let column = (height / (2.0 * mean) + 1.0).min(assembly.grains.len() as f64);
        // Only of elastic spheres stiffnesses depend on any of these.
        let elastic = assembly.pairs.iter().any(|pair| pair.hertz.is_some());
        let overlap = if elastic { assembly.with_first_radii().largest_overlap() } else { 0.0 };
        let both = if assembly.grains.len() > 1 { 2.0 } else { 1.0 };
        Worst {
            speed: both * (fastest(assembly) + assembly.fastest_growth()),
            load: column * assembly.gravity.length(),
            overlap,
        }
    }

    /// Of a contact of this grain at a member of this radius; `share` is 1/2 with an equal grain, 1 with a wall.
    fn loading(&self, body: &Body, radius: f64, share: f64) -> Loading {
        Loading {
            radius: share * radius,
            mass: share * body.mass,
            speed: self.speed,
            force: self.load * body.mass,
            overlap: self.overlap * radius,
        }
    }
}

/// What moves as one: a grain, or a clump.
struct Body {
    dimension: Dimension,
    mass: f64,
    /// The smallest moment of inertia.
    inertia: f64,
    material: u32,
    members: Members,
}

/// All of them; a sphere is not worth a list.
enum Members {
    One(BodyMember),
    Many(Vec<BodyMember>),
}

impl Deref for Members {
    type Target = [BodyMember];

    fn deref(&self) -> &[BodyMember] {
        match self {
            Members::One(member) => slice::from_ref(member),
            Members::Many(members) => members,
        }
    }
}

/// A member of it.
#[derive(Clone, Copy)]
struct BodyMember {
    /// Inverse effective mass of the rotation by a force through its centre, 1/kg: the largest (a × n) J⁻¹ (a × n) of
    /// its arm a.
    rotational_inverse_mass: f64,
    radius: f64,
    /// The part of its surface that others may touch.
    exposed: f64,
}

impl Body {
    /// The smallest mass that a normal force may feel, where it acts beside the centre.
    fn lightest(&self) -> f64 {
        1.0 / (1.0 / self.mass + self.members.iter().map(|member| member.rotational_inverse_mass).fold(0.0, f64::max))
    }
}

/// The largest eigenvalue of [a]×ᵀ D [a]×, D diagonal; that of a itself is 0, so the other two follow from traces.
fn rotational_inverse_mass(arm: DVec3, inverse_moments: DVec3) -> f64 {
    let cross = DMat3::from_cols(arm.cross(DVec3::X), arm.cross(DVec3::Y), arm.cross(DVec3::Z));
    let b = cross.transpose() * DMat3::from_diagonal(inverse_moments) * cross;
    let trace = |m: DMat3| m.x_axis.x + m.y_axis.y + m.z_axis.z;
    let (sum, squares) = (trace(b), trace(b * b));
    0.5 * (sum + (2.0 * squares - sum * sum).max(0.0).sqrt())
}

/// The smallest value of free grains, or of free clumps where there are clumps.
fn smallest_of_bodies(assembly: &Assembly, value: impl Fn(Body) -> f64 + Sync) -> f64 {
    let dimension = dimension(assembly);
    let mass_of = |material: u32, radius| mass(dimension, assembly.materials[material as usize].density, radius);
    if assembly.clumps.is_empty() {
        let body = |g: &Grain| {
            let mass = mass_of(g.material, g.radius);
            let inertia = mass * g.radius * g.radius / inverse_gyration(dimension);
            let members = Members::One(BodyMember { rotational_inverse_mass: 0.0, radius: g.radius, exposed: 1.0 });
            Body { dimension, mass, inertia, material: g.material, members }
        };
        return smallest(&assembly.grains, |g| if g.fixed { f64::INFINITY } else { value(body(g)) });
    }
    let body = |c: &Clump| {
        let shape = &assembly.shapes[c.shape as usize];
        let mass = mass_of(c.material, c.radius);
        let member = |(member, exposed): (&Member, &f64)| BodyMember {
            rotational_inverse_mass: rotational_inverse_mass(member.arm, 1.0 / shape.gyration) / mass,
            radius: c.radius * member.radius,
            exposed: *exposed,
        };
        let members = Members::Many(shape.members.iter().zip(&shape.exposed).map(member).collect());
        let inertia = mass * c.radius * c.radius / (1.0 / shape.gyration.min_element());
        Body { dimension, mass, inertia, material: c.material, members }
    };
    smallest(&assembly.clumps, |c| if c.fixed { f64::INFINITY } else { value(body(c)) })
}

/// The smallest value of many.
fn smallest<T: Sync>(of: &[T], value: impl Fn(&T) -> f64 + Sync) -> f64 {
    of.par_iter().map(&value).reduce(|| f64::INFINITY, f64::min)
}

fn dimension(assembly: &Assembly) -> Dimension {
    if assembly.dimension == 2 { Dimension::Plane } else { Dimension::Space }
}

/// The smallest value over free grains and the pairs of materials they can be part of.
fn smallest_over_contacts(assembly: &Assembly, value: impl Fn(&Body, &Pair) -> f64 + Sync) -> f64 {
    let materials = assembly.materials.len();
    let mut present = vec![false; materials];
    assembly.grains.iter().map(|g| g.material).chain(assembly.walls.iter().map(|w| w.material)).for_each(|m| {
        present[m as usize] = true;
    });
    let of = |body: Body| {
        let pairs = &assembly.pairs[body.material as usize * materials..][..materials];
        let possible = pairs.iter().zip(&present).filter(|(_, present)| **present);
        possible.map(|(pair, _)| value(&body, pair)).fold(f64::INFINITY, f64::min)
    };
    smallest_of_bodies(assembly, of)
}

fn of_contacts(body: &Body, pair: &Pair, worst: &Worst, smallest: f64, others: f64, walls: f64) -> f64 {
    let (mut omega_squared, mut contacts, mut stiffest, mut rolling_rate) = (0.0, 0.0, 0.0_f64, 0.0);
    for member in body.members.iter().filter(|member| member.exposed > 0.0) {
        let c = Coordination::new(body.dimension, member.radius, smallest);
        let k = LargestStiffness::of(pair, &worst.loading(body, member.radius, 1.0));
        // Of a member that shows any surface, a grain touches at least that, and a flat side lies on a wall with all
        // its members.
        let shown = |cap: f64| (member.exposed * others.min(cap)).max(others.min(cap).min(1.0));
        let share = |cap: f64| (2.0 * shown(cap) + walls.min(cap)).min(2.0 * cap);
        // Both parts of the stiffness matrix, of translation and of rotation, by the largest eigenvalue; a tangential
        // force turns by the arm of its member and by the member's own radius.
        let own = share(c.rotational) * member.radius * member.radius / body.inertia;
        let turning = ((share(c.tangential) * member.rotational_inverse_mass).sqrt() + own.sqrt()).powi(2);
        omega_squared += share(c.normal) * k.normal * (1.0 / body.mass + member.rotational_inverse_mass)
            + k.tangential * (share(c.tangential) / body.mass + turning)
            + k.rolling * share(c.rotational) / body.inertia;
        let about_contact =
            1.0 / inverse_rolling_inertia(Rotation::Sphere, body.dimension, member.radius, 1.0 / body.mass);
        rolling_rate += share(c.rotational) * rolling::largest_damping(pair, k.rolling, about_contact) / body.inertia;
        stiffest = stiffest.max(k.normal);
        contacts += (shown(c.contacts) + walls).min(c.contacts).min(c.normal);
    }
    if omega_squared == 0.0 {
        return f64::INFINITY;
    }
    let normal_rate = contacts * damping::largest_rate(pair, stiffest, body.mass);
    let gamma = normal_rate * body.mass / body.lightest() + rolling_rate;
    let bound = (-gamma + (gamma * gamma + 4.0 * omega_squared).sqrt()) / omega_squared;
    // The same without squares, where these are beyond all numbers.
    if bound.is_finite() { bound } else { 4.0 / (gamma + gamma.hypot(2.0 * omega_squared.sqrt())) }
}

/// How far beyond a wall the hardest impact drives the centre of a grain, m: that of the fastest grain, or after a fall
/// from the top of the scene to its bottom, on springs without dashpots that carry its weight as well. 0 where contacts
/// are stiffer than that, and of rigid grains.
pub fn depth_beyond_walls(assembly: &Assembly) -> f64 {
    if assembly.walls.is_empty() || assembly.solver.method != Method::DiscreteElements {
        return 0.0;
    }
    let worst = Worst { load: assembly.gravity.length(), ..Worst::of(assembly) };
    let room = |body: &Body, pair: &Pair| {
        let loading = worst.loading(body, body.members[0].radius, 1.0);
        body.members[0].radius - normal::largest_overlap(pair, &loading)
    };
    (-smallest_over_contacts(assembly, room)).max(0.0)
}

/// No clump may turn further than this in a step, rad: the arc of a radius.
pub const MOST_TURN: f64 = 1.0;

/// The part of what grains may go and turn in a step that the automatic one plans for.
const PLANNED: f64 = 0.25;

/// The step in which the fastest grain or wall, even after falling from the top of the scene to its bottom, goes no
/// further than planned for, and no clump turns further.
fn longest_stride(assembly: &Assembly) -> f64 {
    let grains = &assembly.grains;
    let smallest = smallest_radius(assembly);
    let mean = grains.iter().map(|grain| grain.radius).sum::<f64>() / grains.len() as f64;
    let largest = -self::smallest(grains, |grain| -grain.radius);
    let of_flow = assembly.largest_rate() * (largest + 0.5 * assembly.solver.margin * mean);
    let closing = of_flow + assembly.fastest_growth();
    let stride = PLANNED * 0.5 * smallest.min(assembly.solver.margin * mean) / (fastest(assembly) + closing);
    let spin = assembly.clumps.iter().map(|c| c.spin.length()).fold(0.0, f64::max);
    stride.min(PLANNED * MOST_TURN / spin)
}

/// The step in which the fastest grain, after falling all the time, moves a quarter of the lists' margin.
fn free_flight(assembly: &Assembly, time: f64) -> f64 {
    let fastest = assembly.grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
    let radius = assembly.grains.iter().map(|g| g.radius).sum::<f64>() / assembly.grains.len() as f64;
    let flight = 0.25 * assembly.solver.margin * radius / (fastest + assembly.gravity.length() * time);
    // A body that spins has to be followed around.
    let spin = assembly.clumps.iter().map(|c| c.spin.length()).fold(0.0, f64::max);
    flight.min(0.05 / spin)
}

/// How far grains may fall, m: from the highest of them to the lowest, or to a floor below. 0 without gravity.
fn height(assembly: &Assembly) -> f64 {
    let g = assembly.gravity.length();
    let grains = &assembly.grains;
    let height = |x: DVec3| if g == 0.0 { 0.0 } else { -x.dot(assembly.gravity) / g };
    let floors = assembly.walls.iter().filter_map(|wall| match wall.surface {
        Surface::Plane { point, normal } if height(normal) > 0.0 => Some(height(point)),
        // A drum on its side, or a circle.
        Surface::Cylinder { center, radius } if g > 0.0 && assembly.gravity.z == 0.0 => Some(height(center) - radius),
        _ => None,
    });
    let bottom = floors.fold(smallest(grains, |grain| height(grain.position)), f64::min);
    let top = -smallest(grains, |grain| -height(grain.position));
    top - bottom
}

/// The speed of the fastest grain or wall, and of a fall as far as grains may, m/s.
fn fastest(assembly: &Assembly) -> f64 {
    let extent = assembly.extent();
    let surface = |wall: &Wall| match wall.surface {
        Surface::Cylinder { radius, .. } => wall.top_speed(extent) + wall.spin.abs() * radius,
        Surface::Plane { .. } => wall.top_speed(extent),
    };
    let grains = -smallest(&assembly.grains, |grain| -grain.velocity.length());
    assembly.walls.iter().map(surface).fold(grains.max(0.0), f64::max)
        + (2.0 * assembly.gravity.length() * height(assembly)).sqrt()
}

/// The step of rigid grains, which nothing bounds but what is seen of them: the smallest grain takes 20 steps to fall by
/// its diameter, and none goes further than [`longest_stride`].
///
/// # Errors
/// [`Error::Scene`] if nothing moves.
fn rigid_step(assembly: &Assembly) -> Result<f64> {
    let grains = &assembly.grains;
    let g = assembly.gravity.length();
    let smallest = smallest(grains, |grain| grain.radius);
    let fall = (4.0 * smallest / g).sqrt() / 20.0;
    let dt = fall.min(longest_stride(assembly));
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
/// [`Error::Scene`] if the scene asks for more than the bound without `allow_unstable`, or steps are too small to follow.
pub fn choose(assembly: &Assembly) -> Result<(f64, f64)> {
    let bound = bound(assembly);
    let dt = step_below(assembly, bound)?;
    if !dt.is_normal() || assembly.stop.time.is_some_and(|time| time / dt > MOST_STEPS) {
        return Err(Error::Scene(format!(
            "solver.dt = {dt:e} s: too small to follow; with \"auto\", contacts are too stiff or damped too much for the masses of the \
             grains: look at the stiffnesses, moduli and dampings of the materials"
        )));
    }
    Ok((dt, bound))
}

/// Steps that a clock can count: the time of the last one still grows by one step.
const MOST_STEPS: f64 = 1e15;

fn step_below(assembly: &Assembly, bound: f64) -> Result<f64> {
    match assembly.solver.dt {
        TimeStep::Auto { .. } if assembly.solver.method != Method::DiscreteElements => rigid_step(assembly),
        // Nobody follows collisions whose velocities are damped as rest needs it.
        TimeStep::Auto { fraction } if bound.is_finite() && assembly.solver.adaptive_damping => {
            Ok((fraction * bound).min(longest_stride(assembly)))
        }
        TimeStep::Auto { fraction } if bound.is_finite() => {
            Ok((fraction * bound).min(shortest_contact(assembly) / STEPS_PER_CONTACT).min(longest_stride(assembly)))
        }
        // Nothing can touch: any step is stable and exact; it must only be short enough to be followed.
        TimeStep::Auto { .. } => match assembly.stop.time {
            Some(time) => Ok((time / 1000.0).min(free_flight(assembly, time))),
            None => Err(Error::Scene(
                "solver.dt = \"auto\": nothing in this scene can touch, so there is no bound; give solver.dt or stop.time"
                    .to_owned(),
            )),
        },
        TimeStep::Fixed(dt) if dt > bound && !assembly.solver.allow_unstable => Err(Error::Scene(format!(
            "solver.dt = {dt:e} s is above the stability bound of {bound:e} s; use \"auto\" or a smaller number, or set \
             solver.allow_unstable = true"
        ))),
        TimeStep::Fixed(dt) => Ok(dt),
    }
}
