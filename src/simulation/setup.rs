//! What a scene implies before an engine is chosen: parameters, grid, state at time 0, plans.

use super::{
    grid,
    lists::LEAST_LENGTH,
    options::{EngineChoice, Options},
};
use crate::{
    body::{
        blocks::BLOCK,
        bodies::{NextVelocities, Velocities},
        grains::spins_in_scene,
        rotation::inverse_inertia,
    },
    contact::{cohesion, materials::parameters, rolling},
    error::{Error, Result},
    memory,
    model::{self, Grains, Model, Precision},
    plans::Plans,
    scene::{Assembly, Clump, Grain, Method, Surface},
    solve,
    space::{
        boundary::wrap,
        precision::{
            Point, QUANTA_OF_SLACK, SplitOrientation, add_rotation, arm_end, extent_of, quantised, quantum,
            set_quantum, split,
        },
    },
    state::{
        ARRAYS, Column, Length, Level, Orientation, Packed, Params, Position, PositionLow, RotationIterations, Sizes,
        Spin, State, Velocity, VelocityLow, Wall, present,
    },
    time_step,
    units::{Quantity, Units, power_of_two},
};
use glam::{DVec3, DVec4};

/// Everything a scene implies before an engine is chosen: the state at time 0, its plans, and the time step's bound.
pub struct Setup {
    pub state: State,
    pub plans: Plans,
    pub dt_bound: f64,
}

impl Setup {
    /// Arrays, parameters and plans of a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] if the time step is above its bound, [`Error::Device`] if the host's memory cannot hold it.
    pub fn new(assembly: &Assembly, options: &Options) -> Result<Setup> {
        let (dt, dt_bound) = time_step::choose(assembly)?;
        // The CPU engine has only f64.
        let precision = if options.engine == EngineChoice::Cpu { Precision::Double } else { options.precision };
        let model = Model::of(assembly, precision);
        let (mut params, level) = params(assembly, &model, dt);
        params.slice_shift =
            options.lists_abreast.unwrap_or(1).clamp(1, BLOCK as u32).next_power_of_two().trailing_zeros();
        let units = units(assembly, &model, dt, dt_bound);
        let bodies = assembly.grains.len();
        let guess = bodies * if assembly.dimension == 2 { 4 } else { 6 };
        let sizes = Sizes {
            bodies,
            large: params.large as usize,
            slice_shift: params.slice_shift,
            clumps: assembly.clumps.len(),
            walls: assembly.walls.len(),
            materials: assembly.materials.len(),
            levels: level.len(),
            cells: params.cells as usize,
            entries: options.entries.unwrap_or(guess).max(LEAST_LENGTH),
            history: LEAST_LENGTH,
            contacts: (guess / 2).max(LEAST_LENGTH),
            colors: LEAST_LENGTH,
        };
        params.partial_sums_len = sizes.partial_sums() as u32;
        memory::check_host(bodies as u64 * memory::BYTES_PER_GRAIN)?;
        let range = range(&params, &model, assembly);
        let mut state = State { units, range, ..State::new(model, sizes, params) };
        state.level = level;
        if precision == Precision::Single {
            // As the grains on it have it.
            state.level.iter_mut().for_each(|l| l.radius = state.units.rounded(Quantity::Length, l.radius));
        }
        fill(&mut state, assembly);
        if precision == Precision::Single {
            check_range(&state)?;
        }
        Ok(Setup { plans: Plans::new(&model), state, dt_bound })
    }
}

/// Gaps and overlaps that are none, in radii of the smallest grain: what a step leaves within its tolerance must not
/// cost the next one passes.
const GAP_BAND: f64 = 1e-4;

/// The part of the loads of its two grains that the residual of a contact is relative to: far less than the loads,
/// because the errors of a chain of contacts add up.
const LOAD_FRACTION: f64 = 5e-5;
/// The same without gravity, where loads are all that acts on a contact inside of what collides or is squeezed, and no
/// weight adds up from grain to grain.
const WEIGHTLESS_LOAD_FRACTION: f64 = 0.1;
/// Units in the last place of the loads of two grains below which the residual of their contact may be rounding.
const LOAD_ROUNDINGS: f64 = 4.0;

/// What a device computes in: the mean radius, the mean mass and the step up to which contacts are stable, or the step
/// where none is, or that is not stable.
fn units(assembly: &Assembly, model: &Model, dt: f64, dt_bound: f64) -> Units {
    let grains = assembly.grains.len() as f64;
    let mass = |g: &Grain| time_step::mass(model.dimension, assembly.materials[g.material as usize].density, g.radius);
    let mean_mass = assembly.grains.iter().map(mass).sum::<f64>() / grains;
    let rigid = model.method == model::Method::ContactDynamics;
    Units {
        length: power_of_two(assembly.mean_radius()),
        mass: power_of_two(mean_mass),
        time: power_of_two(if rigid || !dt_bound.is_finite() { dt } else { dt_bound.max(dt) }),
        elastic: model.normal == model::Normal::Hertz,
        rates: model.damping == model::Damping::MassScaled,
        rigid,
    }
}

fn params(assembly: &Assembly, model: &Model, dt: f64) -> (Params, Vec<Level>) {
    let grains = &assembly.grains;
    let mean_radius = assembly.mean_radius();
    let smallest = grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    let largest = grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let margin = assembly.solver.margin * mean_radius;
    let reach = cohesion::reach(assembly);
    // Of contact distances, and not of the lists' reach, which must not change a bit.
    let unit = split(2.0 * largest + reach);
    let mut p = Params {
        gravity: assembly.gravity,
        lower: DVec3::NEG_INFINITY,
        upper: DVec3::INFINITY,
        dt,
        history_dt: dt,
        length_unit: unit,
        inverse_length_unit: 1.0 / unit,
        damping: assembly.solver.damping,
        reach,
        margin: reach + margin,
        displacement_limit: 0.5 * margin,
        step_limit: 0.5 * margin.min(smallest),
        wall_depth: time_step::depth_beyond_walls(assembly),
        turn_limit: time_step::MOST_TURN,
        gap_band: GAP_BAND * smallest,
        pair: parameters(&assembly.pairs[0]),
        bodies: grains.len() as u32,
        large: assembly.large_grains() as u32,
        clumps: assembly.clumps.len() as u32,
        walls: assembly.walls.len() as u32,
        materials: assembly.materials.len() as u32,
        ..Params::default()
    };
    set_relaxation(&mut p, assembly, model.precision, mean_radius);
    set_quanta(&mut p, assembly, model, largest);
    let range = range(&p, model, assembly);
    set_domain(&mut p, assembly, model, range);
    let levels = grid::levels(&mut p, assembly, model, range);
    (p, levels)
}

/// Of contact dynamics.
fn set_relaxation(p: &mut Params, assembly: &Assembly, precision: Precision, mean_radius: f64) {
    if let Method::ContactDynamics(relaxation) = assembly.solver.method {
        p.tolerance = relaxation.tolerance;
        let weightless = assembly.gravity == DVec3::ZERO;
        p.load_fraction = if weightless { WEIGHTLESS_LOAD_FRACTION } else { LOAD_FRACTION };
        p.load_rounding = LOAD_ROUNDINGS * precision.epsilon() / relaxation.tolerance;
        p.max_momentum = if relaxation.solver == solve::Solver::Jacobi { 0.0 } else { 1.0 };
        // Slower than what gravity takes away in a step, so that nothing flies up; without gravity something small.
        let gained = assembly.gravity.length() * p.dt;
        let gentle = if gained > 0.0 { 0.1 * gained } else { 1e-3 * mean_radius / p.dt };
        p.max_correction_velocity = relaxation.max_correction_velocity.unwrap_or(gentle);
    }
}

/// What single precision keeps positions and arms as multiples of.
fn set_quanta(p: &mut Params, assembly: &Assembly, model: &Model, largest: f64) {
    let single = model.precision == Precision::Single;
    let arm = |c: &Clump| c.radius * assembly.shapes[c.shape as usize].reach();
    let longest = assembly.clumps.iter().map(arm).fold(0.0, f64::max);
    p.arm_unit = quantum(if longest > 0.0 { longest } else { largest });
    p.inverse_arm_unit = 1.0 / p.arm_unit;
    let reach = landmarks(assembly).map(|x| x.abs().max_element()).fold(0.0, f64::max);
    set_quantum(p, reach + largest, f64::INFINITY);
    p.position_slack = 1e-5 * largest + if single { QUANTA_OF_SLACK * p.quantum } else { 0.0 };
}

/// Radii of the smallest grain from the origin up to which its overlaps have all digits that they need in single
/// precision, 3e-11 of its radius.
const FAR: f64 = 16384.0;

/// How far from the origin grains may go.
fn range(p: &Params, model: &Model, assembly: &Assembly) -> f64 {
    let smallest = assembly.grains.iter().map(|g| g.radius).fold(f64::INFINITY, f64::min);
    match model.precision {
        Precision::Single => extent_of(p.quantum).max(FAR * smallest),
        Precision::Double => f64::INFINITY,
    }
}

/// Faces or periods.
fn set_domain(p: &mut Params, assembly: &Assembly, model: &Model, range: f64) {
    let domain = &assembly.domain;
    for axis in 0..model.dims() {
        let (lower, upper) = (domain.lower[axis], domain.upper[axis]);
        if domain.periodic[axis] {
            p.period[axis] = upper - lower;
            p.inverse_period[axis] = 1.0 / p.period[axis];
            if model.precision == Precision::Single {
                let whole = quantised(p, p.period)[axis];
                (p.period_low[axis], p.period[axis]) = (p.period[axis] - whole, whole);
            }
            p.cell_origin[axis] = lower;
        } else {
            p.lower[axis] = lower.max(-range);
            p.upper[axis] = upper.min(range);
            p.cell_origin[axis] = assembly.grains.iter().map(|g| g.position[axis]).fold(f64::INFINITY, f64::min);
        }
    }
}

/// Positions of grains, finite corners of the domain and points of walls: how far coordinates go.
fn landmarks(assembly: &Assembly) -> impl Iterator<Item = DVec3> {
    let finite = |x: DVec3| DVec3::select(x.is_finite_mask(), x, DVec3::ZERO);
    let corners = [assembly.domain.lower, assembly.domain.upper].map(finite);
    let middle = middle(assembly);
    let walls = assembly.walls.iter().map(move |wall| anchor(&wall.surface, middle));
    assembly.grains.iter().map(|g| g.position).chain(corners).chain(walls)
}

/// The middle of the box around the grains.
fn middle(assembly: &Assembly) -> DVec3 {
    let bounds = |(low, high): (DVec3, DVec3), g: &Grain| (low.min(g.position), high.max(g.position));
    let (low, high) = assembly.grains.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), bounds);
    0.5 * (low + high)
}

/// A point of a plane, or of the axis of a cylinder, close to the grains: coordinates that go farther than they must
/// cost digits in single precision.
fn anchor(surface: &Surface, middle: DVec3) -> DVec3 {
    match *surface {
        Surface::Plane { point, normal } => middle - (middle - point).dot(normal) * normal,
        Surface::Cylinder { center, .. } => center,
    }
}

/// The grains, walls and materials of a scene.
pub(super) fn fill(state: &mut State, assembly: &Assembly) {
    let dimension = state.model.dimension;
    for (i, grain) in assembly.grains.iter().enumerate() {
        let density = assembly.materials[grain.material as usize].density;
        let mass = time_step::mass(dimension, density, grain.radius);
        state.position[i] = Position { x: grain.position, radius: grain.radius };
        if let Some(low) = state.position_low.get_mut(i) {
            let whole = Position {
                x: quantised(&state.params, grain.position),
                radius: state.units.rounded(Quantity::Length, grain.radius),
            };
            *low = PositionLow { x: grain.position - whole.x, radius: grain.radius - whole.radius };
            state.position[i] = whole;
        }
        state.id[i] = i as u32;
        let inverse_mass = if grain.fixed { 0.0 } else { 1.0 / mass };
        let start = started(state, grain.velocity, grain.spin, inverse_mass);
        let (velocity, spin, low) = (&mut state.velocity, &mut state.spin, &mut state.velocity_low);
        NextVelocities { velocity, spin, low }.store(i, start);
    }
    if state.model.grains == Grains::Clumps {
        fill_clumps(state, assembly);
    }
    let single = state.model.precision == Precision::Single;
    let middle = middle(assembly);
    for (wall, given) in state.wall.iter_mut().zip(&assembly.walls) {
        let point = anchor(&given.surface, middle);
        let (normal, radius) = match given.surface {
            Surface::Plane { normal, .. } => (normal, 0.0),
            Surface::Cylinder { radius, .. } => (DVec3::ZERO, radius),
        };
        let whole = if single { quantised(&state.params, point) } else { point };
        let low = point - whole;
        let number = |x| if single { state.units.rounded(Quantity::Number, x) } else { x };
        let whole_normal = normal.map(number);
        let whole_radius = if single { state.units.rounded(Quantity::Length, radius) } else { radius };
        *wall = Wall {
            point: whole,
            low,
            normal: whole_normal,
            normal_low: normal - whole_normal,
            velocity: given.velocity,
            radius: whole_radius,
            radius_low: radius - whole_radius,
            spin: given.spin,
        };
    }
    if !state.material.is_empty() {
        let materials = assembly.grains.iter().map(|g| g.material).chain(assembly.walls.iter().map(|w| w.material));
        state.material = materials.collect();
        state.pair = assembly.pairs.iter().map(parameters).collect();
    }
    rolling::fill(state, assembly);
}

/// The velocities at the start, with what single precision leaves out of them.
fn started(state: &State, v: DVec3, spin: DVec3, inverse_mass: f64) -> Velocities {
    let rest = Velocity { v: DVec3::ZERO, inverse_mass };
    Velocities::changed(state, rest, DVec3::ZERO, VelocityLow::default(), [v, spin])
}

/// The clumps of a scene, and what their members know of them.
fn fill_clumps(state: &mut State, assembly: &Assembly) {
    let (dimension, precision) = (state.model.dimension, state.model.precision);
    state.clump_of_id = assembly.owners();
    let units = state.units;
    let rounded = |quantity, v: DVec3| DVec3::from_array(v.to_array().map(|x| units.rounded(quantity, x)));
    for (c, clump) in assembly.clumps.iter().enumerate() {
        let shape = &assembly.shapes[clump.shape as usize];
        let density = assembly.materials[clump.material as usize].density;
        let mass = time_step::mass(dimension, density, clump.radius);
        let inverse_mass = if clump.fixed { 0.0 } else { 1.0 / mass };
        let inverse_moments = (1.0 / shape.gyration) * inverse_mass / (clump.radius * clump.radius);
        // Whether a clump is round is asked of these numbers on both sides, so both must have the same.
        let inverse_moments = match precision {
            Precision::Single => rounded(Quantity::InverseInertia, inverse_moments),
            Precision::Double => inverse_moments,
        };
        let principal = (clump.orientation * shape.frame).normalize();
        state.inverse_moments[c] = Spin(inverse_moments);
        let in_scene = spins_in_scene(&state.model, inverse_moments);
        let spin = if in_scene { clump.spin } else { principal.inverse() * clump.spin };
        let start = started(state, clump.velocity, spin, inverse_mass);
        (state.clump_velocity[c], state.clump_spin[c]) = (start.velocity, start.spin);
        if let Some(low) = state.clump_velocity_low.get_mut(c) {
            *low = start.low;
        }
        if let Some(gain) = state.spin_increment.get_mut(c) {
            *gain = Spin::default();
        }
        state.rotation_iterations[0] = RotationIterations::default();
        let turning = add_rotation(state, &SplitOrientation::default(), DVec4::from(principal));
        state.orientation[c] = Orientation(turning.q);
        state.center[c] = clump.position;
        if precision == Precision::Single {
            state.orientation_low[c] = Orientation(turning.low);
            state.orientation_rest[c] = Orientation(turning.rest);
            state.center[c] = quantised(&state.params, clump.position);
            state.center_low[c] = clump.position - state.center[c];
        }
        let members = assembly.members(c);
        state.first_member[c] = members.start as u32;
        state.first_member[c + 1] = members.end as u32;
        for (member_id, member) in members.zip(&shape.members) {
            state.velocity[member_id].inverse_mass = inverse_mass;
            let arm = clump.radius * member.arm;
            state.member_offset[member_id] = Packed(arm);
            if precision == Precision::Single {
                // As the device will have them, so that no member jumps in the first step.
                state.member_offset[member_id] = Packed(rounded(Quantity::Length, arm));
                let center = Point { x: state.center[c], low: state.center_low[c] };
                let arm = state.member_offset[member_id].0;
                let point = arm_end(state, center, state.orientation[c].0, state.orientation_low[c].0, arm);
                let point = wrap(state, point);
                (state.position[member_id].x, state.position_low[member_id].x) = (point.x, point.low);
            }
        }
    }
}

/// In units of the scene: numbers up to this may be squared and multiplied in single precision, and what is divided by is
/// at least its inverse.
const RANGE: f64 = 1e15;

/// What leaves the range of f32 must not get to a device that computes in it.
///
/// # Errors
/// [`Error::Scene`] with the number and whose it is.
fn check_range(state: &State) -> Result<()> {
    check_lanes(state, |_| "scene".to_owned(), "", &vec![state.params], Quantity::Number)?;
    for array in present(&state.model, ARRAYS).into_iter().filter(|array| array.original() == array.name) {
        let owner = match array.length {
            Length::Bodies => "grain",
            Length::Clumps => "clump",
            Length::Walls => "wall",
            Length::MaterialsSquared => "pair of materials",
            _ => continue,
        };
        check_lanes(state, |k| format!("{owner} {k}"), array.name, state.column(array), array.quantity)?;
    }
    // A member turns with its clump, whose moments have been looked at.
    if state.model.grains == Grains::Spheres {
        for (i, (position, velocity)) in state.position.iter().zip(&state.velocity).enumerate() {
            let inertia = inverse_inertia(state, position, velocity.inverse_mass);
            if !in_range(state, Quantity::InverseInertia, inertia) {
                return Err(beyond(
                    &format!("grain {i}"),
                    "inverse moment of inertia",
                    inertia,
                    Quantity::InverseInertia,
                ));
            }
        }
    }
    Ok(())
}

/// The same of an array.
fn check_lanes(
    state: &State,
    owner: impl Fn(usize) -> String,
    name: &str,
    column: &dyn Column,
    of: Quantity,
) -> Result<()> {
    let dims = state.model.dims();
    let (quantities, members) = (column.quantities(of, dims), column.names(dims));
    let (mut lane, mut found) = (0, None);
    column.lanes(dims, &mut |x| {
        if found.is_none() && !in_range(state, quantities[lane % quantities.len()], x) {
            found = Some((lane, x));
        }
        lane += 1;
    });
    let Some((lane, x)) = found else { return Ok(()) };
    let (element, lane) = (lane / quantities.len(), lane % quantities.len());
    let ends = column.widths(dims).into_iter().scan(0, |end, width| {
        *end += width;
        Some(*end)
    });
    let member = members.get(ends.take_while(|end| *end <= lane).count()).copied();
    let what = [Some(name), member].into_iter().flatten().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".");
    Err(beyond(&owner(element), &what.replace('_', " "), x, quantities[lane]))
}

/// Whether single precision can compute with a number. Bounds that there are none of are infinite, and become the
/// largest number.
fn in_range(state: &State, quantity: Quantity, x: f64) -> bool {
    // What is no number stops the run, and not because of its size.
    let size = (x / state.units.of(quantity)).abs();
    let divides = matches!(
        quantity,
        Quantity::Time
            | Quantity::InverseMass
            | Quantity::InverseInertia
            | Quantity::NormalStiffness
            | Quantity::TangentialStiffness
    );
    size == 0.0 || !size.is_finite() || size <= RANGE && (size >= 1.0 / RANGE || !divides)
}

fn beyond(owner: &str, what: &str, x: f64, quantity: Quantity) -> Error {
    Error::Scene(format!(
        "{owner}: {what} = {x:e} {} is beyond single precision beside the other numbers of the scene; use --precision \
         double or --engine cpu",
        quantity.unit()
    ))
}
