//! The state at time 0, made of a scene piece by piece, so that nobody needs room for all of it at once.

use crate::{
    body::{
        bodies::{NextVelocities, Velocities},
        grains::spins_in_scene,
        rotation::inverse_inertia,
    },
    contact::{materials::parameters, rolling},
    engine::PIECE,
    error::{Error, Result},
    model::{Grains, Method, Precision},
    scene::{self, Assembly, Grain, GrowthLaw, Numbers, Span, Surface, Target},
    space::{
        boundary::wrap,
        deform_cell::stretched,
        precision::{Point, SplitOrientation, add_rotation, arm_end, leading, quantised},
    },
    state::{
        ARRAYS, Array, Cell, Column, GrowthStep, Length, NONE, Orientation, PATH_STEPS, Packed, Position, PositionLow,
        Sizes, Spin, StartSize, State, Velocity, VelocityLow, Wall, WallServo, array::*, present,
    },
    time_step,
    units::Quantity,
};
use glam::{DVec3, DVec4};
use rayon::prelude::*;
use std::ops::Range;

/// What the scene says of its bodies.
const OF_BODIES: [&Array; 10] = [
    &POSITION,
    &POSITION_LOW,
    &VELOCITY,
    &SPIN,
    &VELOCITY_LOW,
    &ID,
    &CLUMP_OF_ID,
    &MEMBER_OFFSET,
    &MATERIAL,
    &START_SIZE,
];

/// The same of clumps.
const OF_CLUMPS: [&Array; 11] = [
    &FIRST_MEMBER,
    &INVERSE_MOMENTS,
    &CENTER,
    &CENTER_LOW,
    &ORIENTATION,
    &ORIENTATION_LOW,
    &ORIENTATION_REST,
    &CLUMP_VELOCITY,
    &CLUMP_SPIN,
    &CLUMP_VELOCITY_LOW,
    &SPIN_INCREMENT,
];

/// Walls, the cell, materials and their growth: the few numbers that do not become more with the grains.
pub fn fill_small(state: &mut State, assembly: &Assembly, growth: Option<GrowthLaw>) {
    if (WALL.needed)(&state.model) {
        state.wall = walls(state, assembly);
    }
    if (WALL_SERVO.needed)(&state.model) {
        state.wall_servo = wall_servos(state, assembly);
    }
    if let Some(guides) = Guides::of(assembly, growth) {
        let path = guides.path(state, 0, PATH_STEPS as u32).0;
        (state.wall_path, state.growth_path) = (path.wall_path, path.growth_path);
        state.growth_rate = guides.growth_rates(0, state.params.dt);
        state.growth_rate_next.clone_from(&state.growth_rate);
    }
    if (CELL.needed)(&state.model) {
        state.cell = vec![cell(state, assembly)];
        state.cell_next.clone_from(&state.cell);
    }
    if (PAIR.needed)(&state.model) {
        state.pair = assembly.pairs.iter().map(parameters).collect();
    }
    rolling::fill(state, assembly);
}

/// Takes elements of arrays: which arrays, the number of the first element, and a state with these alone.
pub type Put<'p> = dyn FnMut(&[&'static Array], usize, &State) -> Result<()> + 'p;

/// Hand out the grains of a scene, piece by piece.
///
/// # Errors
/// [`Error::Scene`] for what single precision cannot hold, and what `put` says.
pub fn fill(like: &State, assembly: &Assembly, put: &mut Put) -> Result<()> {
    let model = &like.model;
    let pieces = pieces(assembly);
    for several in pieces.chunks(rayon::current_num_threads()) {
        let states: Vec<Result<State>> = several.par_iter().map(|piece| filled(like, assembly, piece)).collect();
        for (piece, state) in several.iter().zip(states) {
            let state = state?;
            put(&present(model, &OF_BODIES), piece.bodies.start, &state)?;
            put(&present(model, &OF_CLUMPS), piece.clumps.start, &state)?;
        }
    }
    let mut of_walls = State::bare(*model, like.sizes, like.params);
    of_walls.material = assembly.walls.iter().map(|wall| wall.material).collect();
    put(&present(model, &[&MATERIAL]), assembly.grains.len(), &of_walls)
}

/// Bodies, in a scene with clumps those of whole clumps.
#[derive(Default)]
pub struct Piece {
    bodies: Range<usize>,
    clumps: Range<usize>,
}

fn pieces(assembly: &Assembly) -> Vec<Piece> {
    let (bodies, clumps) = (assembly.grains.len(), assembly.clumps.len());
    let mut pieces: Vec<Piece> = Vec::new();
    loop {
        let (body, clump) = pieces.last().map_or((0, 0), |last| (last.bodies.end, last.clumps.end));
        if body == bodies {
            return pieces;
        }
        let piece = match clumps {
            0 => Piece { bodies: body..(body + PIECE).min(bodies), clumps: 0..0 },
            _ => {
                let end = assembly.clumps.partition_point(|c| (c.first as usize) < body + PIECE);
                Piece { bodies: body..assembly.members(end - 1).end, clumps: clump..end }
            }
        };
        pieces.push(piece);
    }
}

/// A state of these bodies alone.
fn filled(like: &State, assembly: &Assembly, piece: &Piece) -> Result<State> {
    let sizes = Sizes { bodies: piece.bodies.len(), clumps: piece.clumps.len(), walls: 0, ..like.sizes };
    let mut state = State { units: like.units, range: like.range, ..State::bare(like.model, sizes, like.params) };
    state.cell_next.clone_from(&like.cell);
    for array in present(&like.model, OF_BODIES.iter().chain(&OF_CLUMPS)) {
        state.column_mut(array).resize(sizes.of(array.length));
    }
    fill_bodies(&mut state, assembly, piece.bodies.clone());
    if state.model.grains == Grains::Clumps {
        fill_clumps(&mut state, assembly, piece);
    }
    if state.model.precision == Precision::Single {
        check_range(&state, &assembly.numbers, piece)?;
    }
    Ok(state)
}

fn fill_bodies(state: &mut State, assembly: &Assembly, bodies: Range<usize>) {
    let dimension = state.model.dimension;
    for (i, grain) in assembly.grains[bodies.clone()].iter().enumerate() {
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
        state.id[i] = (bodies.start + i) as u32;
        let inverse_mass = if grain.fixed { 0.0 } else { 1.0 / mass };
        let start = started(state, grain.velocity, grain.spin, inverse_mass);
        let (velocity, spin, low) = (&mut state.velocity, &mut state.spin, &mut state.velocity_low);
        NextVelocities { velocity, spin, low }.store(i, start);
        if let Some(size) = state.start_size.get_mut(i) {
            let [radius, radius_low] = leading(state.model.precision, grain.radius);
            *size = StartSize { radius, radius_low, inverse_mass };
        }
    }
    state.material.iter_mut().zip(&assembly.grains[bodies]).for_each(|(material, grain)| *material = grain.material);
}

/// The velocities at the start, with what single precision leaves out of them.
fn started(state: &State, v: DVec3, spin: DVec3, inverse_mass: f64) -> Velocities {
    let rest = Velocity { v: DVec3::ZERO, inverse_mass };
    Velocities::changed(state, rest, DVec3::ZERO, VelocityLow::default(), [v, spin])
}

/// The clumps of a piece, and what their members know of them.
fn fill_clumps(state: &mut State, assembly: &Assembly, piece: &Piece) {
    let (dimension, precision) = (state.model.dimension, state.model.precision);
    let units = state.units;
    let rounded = |quantity, v: DVec3| DVec3::from_array(v.to_array().map(|x| units.rounded(quantity, x)));
    for (c, number) in piece.clumps.clone().enumerate() {
        let clump = &assembly.clumps[number];
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
        let turning = add_rotation(state, &SplitOrientation::default(), DVec4::from(principal));
        state.orientation[c] = Orientation(turning.q);
        state.center[c] = clump.position;
        if precision == Precision::Single {
            state.orientation_low[c] = Orientation(turning.low);
            state.orientation_rest[c] = Orientation(turning.rest);
            state.center[c] = quantised(&state.params, clump.position);
            state.center_low[c] = clump.position - state.center[c];
        }
        let members = assembly.members(number);
        state.first_member[c] = members.start as u32;
        state.first_member[c + 1] = members.end as u32;
        for (member_id, member) in members.zip(&shape.members) {
            let i = member_id - piece.bodies.start;
            state.clump_of_id[i] = number as u32;
            state.velocity[i].inverse_mass = inverse_mass;
            let arm = clump.radius * member.arm;
            state.member_offset[i] = Packed(arm);
            if precision == Precision::Single {
                // As the device will have them, so that no member jumps in the first step.
                state.member_offset[i] = Packed(rounded(Quantity::Length, arm));
                let center = Point { x: state.center[c], low: state.center_low[c] };
                let arm = state.member_offset[i].0;
                let point = arm_end(state, center, state.orientation[c].0, state.orientation_low[c].0, arm);
                let point = wrap(state, state.model.boundary, point);
                (state.position[i].x, state.position_low[i].x) = (point.x, point.low);
            }
        }
    }
}

fn cell(state: &State, assembly: &Assembly) -> Cell {
    let (p, single) = (&state.params, state.model.precision == Precision::Single);
    let split = |x: DVec3| if single { quantised(p, x) } else { x };
    let (length, tilt) = (p.period, assembly.domain.tilt);
    let (rate, shear_rate) = assembly.cell.gradient(p.dt);
    let cell = Cell {
        length: split(length),
        length_low: length - split(length),
        tilt: Spin(split(tilt)),
        tilt_low: Spin(tilt - split(tilt)),
        rate,
        shear_rate: Spin(shear_rate),
        rate_next: rate,
        shear_rate_next: Spin(shear_rate),
        largest_rate: (rate.length_squared() + shear_rate.length_squared()).sqrt(),
        ..Cell::default()
    };
    stretched(p, cell)
}

/// What the host says of each step: where walls go, and how radii change.
pub struct Guides {
    /// None where walls move with velocities that never change, or not at all.
    walls: Vec<scene::Wall>,
    middle: DVec3,
    growth: Option<GrowthLaw>,
    materials: u32,
}

impl Guides {
    /// None where there is nothing to say.
    pub fn of(assembly: &Assembly, growth: Option<GrowthLaw>) -> Option<Guides> {
        let guided = assembly.walls.iter().any(scene::Wall::is_guided);
        (guided || growth.is_some()).then(|| Guides {
            walls: if guided { assembly.walls.clone() } else { Vec::new() },
            middle: middle(assembly),
            growth,
            materials: assembly.materials.len() as u32,
        })
    }

    /// How fast radii have grown in the step before, over themselves, 1/s, by material.
    fn growth_rates(&self, step: u64, dt: f64) -> Vec<f64> {
        let of = |law: &GrowthLaw| (0..self.materials).map(|m| law.rate(m, step as f64 * dt, dt)).collect();
        self.growth.as_ref().map_or_else(Vec::new, of)
    }

    /// What grains have become at this step, by material.
    fn grown<'a>(&'a self, like: &'a State, step: u64) -> impl Iterator<Item = GrowthStep> + 'a {
        let (dt, dims) = (like.params.dt, like.model.dims() as i32);
        let of = move |law: &'a GrowthLaw| {
            (0..self.materials).map(move |material| {
                let time = step as f64 * dt;
                let all = law.factor(material, time);
                let [factor, factor_low] = leading(like.model.precision, all);
                GrowthStep { factor, factor_low, inverse_volume: all.powi(-dims), rate: law.rate(material, time, dt) }
            })
        };
        self.growth.iter().flat_map(of)
    }

    /// A state with the walls, and the factors of radii, after each of the steps that follow on `step`, and how far the walls
    /// get from the origin, m.
    pub fn path(&self, like: &State, step: u64, steps: u32) -> (State, f64) {
        let dt = like.params.dt;
        let mut path =
            State { units: like.units, range: like.range, ..State::bare(like.model, like.sizes, like.params) };
        for next in (step + 1..).take(steps as usize) {
            path.wall_path.extend(self.walls.iter().map(|wall| guided(like, wall, self.middle, next as f64 * dt)));
            path.growth_path.extend(self.grown(like, next));
        }
        let farthest = path.wall_path.iter().map(|wall| wall.point.abs().max_element()).fold(0.0, f64::max);
        (path, farthest)
    }
}

/// The walls at time 0.
fn walls(state: &State, assembly: &Assembly) -> Vec<Wall> {
    let middle = middle(assembly);
    let wall = |given: &scene::Wall| {
        let point = anchor(&given.surface, middle);
        match given.is_guided() {
            true => guided(state, given, middle, 0.0),
            false => Wall {
                driven: u32::from(given.servo.is_some()),
                ..device_wall(state, &given.surface, point, given.velocity, given.spin * DVec3::Z)
            },
        }
    };
    assembly.walls.iter().map(wall).collect()
}

/// Speeds over their limit that the servo of a wall still tells apart: there is hardly a contact then.
const STEEPEST_APPROACH: f64 = 1e3;

/// What the servos of walls are asked for; of a wall without one nothing.
fn wall_servos(state: &State, assembly: &Assembly) -> Vec<WallServo> {
    let least_radius = assembly.grains.iter().map(|grain| grain.radius).fold(0.0, f64::max);
    let servo = |(number, wall): (usize, &scene::Wall)| {
        let Some(servo) = wall.servo else { return WallServo::default() };
        let (force, pressure) = match servo.target {
            Target::Force(force) => (force, 0.0),
            Target::Pressure(pressure) => (0.0, pressure),
        };
        let area = assembly.area_of_wall(number);
        let span = |span: Option<Span>| match span {
            Some(Span::Fixed(length)) => (length, NONE, NONE),
            Some(Span::Between(from, to)) => (0.0, from as u32, to as u32),
            Some(Span::Radius(of)) => (0.0, of as u32, of as u32),
            None => (0.0, NONE, NONE),
        };
        let (breadth, breadth_from, breadth_to) = span(area.map(|area| area.breadth));
        let (depth, depth_from, depth_to) = span(area.map(|area| area.depth));
        let at_start = area.map_or(0.0, |area| area.of(&assembly.walls, assembly.dimension));
        let time = state.params.dt / servo.gain;
        WallServo {
            along: wall.velocity,
            force,
            pressure,
            factor: area.map_or(0.0, |area| area.factor),
            breadth,
            depth,
            breadth_from,
            breadth_to,
            depth_from,
            depth_to,
            time,
            most_speed: servo.max_speed,
            least_stiffness: (force + pressure * at_start) / (STEEPEST_APPROACH * time * servo.max_speed),
            least_radius,
        }
    };
    assembly.walls.iter().enumerate().map(servo).collect()
}

/// A wall at a time, with its mean velocity in the step before, as grains have theirs; in contact dynamics in the one that
/// follows, at whose end contacts are solved.
fn guided(state: &State, wall: &scene::Wall, middle: DVec3, time: f64) -> Wall {
    let dt = state.params.dt;
    let ahead = if state.model.method == Method::ContactDynamics { dt } else { 0.0 };
    let (now, moving) = (wall.at(time, dt), wall.at(time + ahead, dt));
    let point = anchor(&now.surface, middle);
    device_wall(state, &now.surface, point, moving.velocity_at(point), moving.spin)
}

/// A wall as kernels have it.
fn device_wall(state: &State, surface: &Surface, point: DVec3, velocity: DVec3, spin: DVec3) -> Wall {
    let single = state.model.precision == Precision::Single;
    let (normal, radius) = match *surface {
        Surface::Plane { normal, .. } => (normal, 0.0),
        Surface::Cylinder { radius, .. } => (DVec3::ZERO, radius),
    };
    let whole = if single { quantised(&state.params, point) } else { point };
    let number = |x| if single { state.units.rounded(Quantity::Number, x) } else { x };
    let whole_normal = normal.map(number);
    let whole_radius = if single { state.units.rounded(Quantity::Length, radius) } else { radius };
    Wall {
        point: whole,
        low: point - whole,
        normal: whole_normal,
        normal_low: normal - whole_normal,
        velocity,
        radius: whole_radius,
        radius_low: radius - whole_radius,
        growth: 0.0,
        velocity_next: velocity,
        growth_next: 0.0,
        driven: 0,
        spin: Spin(spin),
    }
}

/// The middle of the box around the grains.
pub fn middle(assembly: &Assembly) -> DVec3 {
    let bounds = |(low, high): (DVec3, DVec3), g: &Grain| (low.min(g.position), high.max(g.position));
    let (low, high) = assembly.grains.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), bounds);
    0.5 * (low + high)
}

/// A point of a plane, or of the axis of a cylinder, close to the grains: coordinates that go farther than they must
/// cost digits in single precision.
pub fn anchor(surface: &Surface, middle: DVec3) -> DVec3 {
    match *surface {
        Surface::Plane { point, normal } => middle - (middle - point).dot(normal) * normal,
        Surface::Cylinder { center, .. } => center,
    }
}

/// In units of the scene: numbers up to this may be squared and multiplied in single precision, and what is divided by is
/// at least its inverse.
const RANGE: f64 = 1e15;

/// What leaves the range of f32 must not get to a device that computes in it: parameters, and the arrays that there are,
/// of these bodies and clumps.
///
/// # Errors
/// [`Error::Scene`] with the number and whose it is.
pub fn check_range(state: &State, numbers: &Numbers, piece: &Piece) -> Result<()> {
    let grain = |k: usize| format!("grain {}", numbers.of_grain(piece.bodies.start + k));
    let clump = |k: usize| format!("clump {}", numbers.of_clump(piece.clumps.start + k));
    check_lanes(state, |_| "scene".to_owned(), "", &vec![state.params], Quantity::Number)?;
    for array in present(&state.model, ARRAYS).into_iter().filter(|array| array.original() == array.name) {
        let owner: &dyn Fn(usize) -> String = match array.length {
            Length::Bodies => &grain,
            Length::Clumps => &clump,
            Length::Walls => &|k| format!("wall {k}"),
            Length::MaterialsSquared => &|k| format!("pair of materials {k}"),
            _ => continue,
        };
        check_lanes(state, owner, array.name, state.column(array), array.quantity)?;
    }
    // A member turns with its clump, whose moments have been looked at.
    if state.model.grains == Grains::Spheres {
        let unit = state.units.of(Quantity::InverseInertia);
        for (i, (position, velocity)) in state.position.iter().zip(&state.velocity).enumerate() {
            let inertia = inverse_inertia(state, position, velocity.inverse_mass);
            if !in_range(unit, Quantity::InverseInertia, inertia) {
                return Err(beyond(&grain(i), "inverse moment of inertia", inertia, Quantity::InverseInertia));
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
    let units: Vec<f64> = quantities.iter().map(|quantity| state.units.of(*quantity)).collect();
    let (mut element, mut lane, mut found) = (0, 0, None);
    column.lanes(dims, &mut |x| {
        if found.is_none() && !in_range(units[lane], quantities[lane], x) {
            found = Some((element, lane, x));
        }
        lane += 1;
        if lane == units.len() {
            (element, lane) = (element + 1, 0);
        }
    });
    let Some((element, lane, x)) = found else { return Ok(()) };
    let ends = column.widths(dims).into_iter().scan(0, |end, width| {
        *end += width;
        Some(*end)
    });
    let member = members.get(ends.take_while(|end| *end <= lane).count()).copied();
    let what = [Some(name), member].into_iter().flatten().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".");
    Err(beyond(&owner(element), &what.replace('_', " "), x, quantities[lane]))
}

/// Whether single precision can compute with a number in a unit. Bounds that there are none of are infinite, and become the
/// largest number.
fn in_range(unit: f64, quantity: Quantity, x: f64) -> bool {
    // What is no number stops the run, and not because of its size.
    let size = (x / unit).abs();
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
