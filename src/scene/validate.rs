//! From the scene file to the assembly: every value checked, every default filled in.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::bodies::{Bodies, Placed, Pose, add_waiting, numbers, orientation};
use super::check::{self, AXES, Check, show, show_vector};
use super::grown::check_growth;
use super::growth::{growth, initial_factors};
use super::insertion::{Waiting, populate_over_time, split};
use super::neighbours::Neighbours;
use super::origin::Origin;
use super::outlet::outlets;
use super::populate::{Site, populate};
use super::schema::{self, Boundary, Face, File, Format, Spin, Twist};
use super::shape::{Shape, Shapes};
use super::targets::check_cell;
use super::wall_targets::{check_areas, limit_speeds};
use super::walls::{check_apart, walls};
use super::{
    Assembly, Cell, Clump, Domain, Grain, JammingProtocol, Material, Method, Numbers, Output, Relaxation, Solver, Stop,
    TimeStep, Wall, materials,
};
use crate::{Error, Result, solve};
use std::str::FromStr;

/// Overlap that a start may have, in radii of the smaller grain.
const OVERLAP: f64 = 0.1;

/// Checks a scene and places its grains.
pub fn assemble(file: &File, origin: &Origin) -> Result<Assembly> {
    check::dimension(file.dimension, origin)?;
    let check = &check_of(file, origin);
    let mut assembly = without_grains(file, check)?;
    place(file, &mut assembly, check)?;
    limit_speeds(&mut assembly, check)?;
    check_start(&assembly, check)?;
    Ok(assembly)
}

/// A scene that goes on with the grains of another one, from wherever they will be: those of `like` as they are there, and
/// what the file has of grains, which is placed by itself.
pub fn outline(file: &File, origin: &Origin, like: &Assembly) -> Result<Assembly> {
    let check = &Check { placed: false, ..check_of(file, origin) };
    let mut assembly = without_grains(file, check)?;
    let mut added = assembly.clone();
    if !(file.grain.is_empty() && file.population.is_empty()) {
        place(file, &mut added, check)?;
    }
    let like = &*like.whole();
    (assembly.grains, assembly.clumps, assembly.shapes) =
        (like.grains.clone(), like.clumps.clone(), like.shapes.clone());
    assembly.waiting = like.waiting;
    let material = |of: u32| check.material("material", &like.materials[of as usize].name);
    let of_grains = assembly.grains.iter_mut().map(|grain| &mut grain.material);
    let of_clumps = assembly.clumps.iter_mut().map(|clump| &mut clump.material);
    of_grains.chain(of_clumps).try_for_each(|of| material(*of).map(|found| *of = found))?;
    add_waiting(&mut assembly, added.whole().into_owned());
    check_count(assembly.grains.len(), check)?;
    let smallest = assembly.grains.iter().map(|grain| grain.radius).fold(f64::INFINITY, f64::min);
    check_apart(&assembly.walls, smallest, check)?;
    check_areas(&assembly, check)?;
    limit_speeds(&mut assembly, check)?;
    // What the cell will begin with is not known yet.
    let fraction = assembly.stop.packing_fraction.take();
    check_growth(&assembly, check)?;
    check_cell(&assembly, check)?;
    check_adaptive_damping(&assembly, check)?;
    assembly.stop.packing_fraction = fraction;
    Ok(assembly)
}

fn check_of<'a>(file: &'a File, origin: &'a Origin) -> Check<'a> {
    let materials: Vec<&str> = file.material.keys().map(String::as_str).collect();
    Check {
        origin,
        dimension: file.dimension,
        rigid: file.solver.method == schema::Method::Cd,
        densities: file.material.values().map(|material| material.density).collect(),
        initial: initial_factors(&file.growth, &materials),
        placed: true,
        materials,
    }
}

/// Everything but the grains and their shapes.
fn without_grains(file: &File, check: &Check) -> Result<Assembly> {
    let pairs = materials::pairs(file, check)?;
    let gravity = match &file.gravity {
        Some(gravity) => check.vector("gravity", gravity)?,
        None => DVec3::ZERO - 9.81 * DVec3::AXES[file.dimension - 1],
    };
    let domain = domain(file.domain.as_ref(), check)?;
    let usual = Cell::default();
    let cell = Cell {
        strain_rate: file.cell.strain_rate.array().map(Option::unwrap_or_default),
        stress: file.cell.stress.array(),
        inertial_number: file.cell.inertial_number.unwrap_or(usual.inertial_number),
        gain: file.cell.gain.unwrap_or(usual.gain),
    };
    let material =
        |(name, material): (&String, &schema::Material)| Material { name: name.clone(), density: material.density };
    Ok(Assembly {
        dimension: file.dimension,
        gravity,
        domain,
        cell,
        materials: file.material.iter().map(material).collect(),
        pairs,
        walls: walls(&file.wall, &domain, check)?,
        grains: Vec::new(),
        shapes: Vec::new(),
        clumps: Vec::new(),
        insertions: Vec::new(),
        outlets: outlets(&file.outlet, &domain, check)?,
        growth: growth(&file.growth, check.placed, check)?,
        waiting: 0,
        numbers: Numbers::default(),
        solver: solver(&file.solver, check)?,
        stop: stop(&file.stop, file.jamming.as_ref(), check)?,
        output: output(&file.output, check)?,
        notices: Vec::new(),
    })
}

/// Place the grains.
fn place(file: &File, assembly: &mut Assembly, check: &Check) -> Result<()> {
    let Assembly { domain, walls, gravity, .. } = assembly;
    let site = Site { domain, walls, gravity: *gravity, seed: file.seed };
    let mut bodies = Bodies::new(Shapes::read(&file.shape, check)?, *domain);
    let waiting = grains(file, &site, &mut bodies, check)?;
    assembly.notices = std::mem::take(&mut bodies.notices);
    let named = bodies.numbers.clone();
    (assembly.shapes, assembly.grains, assembly.clumps) = bodies.finish();
    assembly.numbers = numbers(&named, assembly.grains.len(), &assembly.clumps);
    split(assembly, waiting);
    fold_ends(&mut assembly.grains, &mut assembly.clumps, &assembly.domain);
    Ok(())
}

fn domain(domain: Option<&schema::Domain>, check: &Check) -> Result<Domain> {
    let mut out = Domain { lower: DVec3::NEG_INFINITY, upper: DVec3::INFINITY, ..Domain::default() };
    let Some(domain) = domain else {
        return Ok(out);
    };
    let (lower, upper) = check.corners("domain", &domain.lower, &domain.upper)?;
    let faces = match &domain.boundary {
        None => vec![Face::Open; check.dimension],
        Some(Boundary::Same(face)) => vec![*face; check.dimension],
        Some(Boundary::Each(faces)) => faces.clone(),
    };
    if faces.len() != check.dimension {
        let message = format!("has {} entries, must be one word or {}, one per axis", faces.len(), check.dimension);
        return Err(check.origin.wrong("domain.boundary", message));
    }
    for (axis, face) in faces.iter().enumerate() {
        out.lower[axis] = lower[axis];
        out.upper[axis] = upper[axis];
        out.periodic[axis] = *face == Face::Periodic;
        out.outlet[axis] = *face == Face::Outlet;
    }
    if let Some(schema::Tilt { yz, xz, xy }) = domain.tilt {
        out.tilt = DVec3::new(yz, xz, xy);
    }
    Ok(out)
}

fn solver(solver: &schema::Solver, check: &Check) -> Result<Solver> {
    let method = method(solver, check)?;
    let (damping, adaptive_damping) = match &solver.damping {
        schema::Damping::Constant(damping) => (*damping, false),
        schema::Damping::Word(word) if word == "adaptive" => (0.0, true),
        schema::Damping::Word(word) => {
            let rule = "must be \"adaptive\", or 0 or a positive number of 1/s";
            return Err(check.origin.bad("solver.damping", format!("\"{word}\""), rule));
        }
    };
    let usual = if adaptive_damping { ADAPTIVE_FRACTION } else { DT_FRACTION };
    let fraction = check.fraction("solver.dt_fraction", solver.dt_fraction.unwrap_or(usual))?;
    let dt = match &solver.dt {
        schema::TimeStep::Seconds(dt) => TimeStep::Fixed(*dt),
        schema::TimeStep::Word(word) if word == "auto" => TimeStep::Auto { fraction },
        schema::TimeStep::Word(word) => {
            let rule = "must be \"auto\" or a positive number of s";
            return Err(check.origin.bad("solver.dt", format!("\"{word}\""), rule));
        }
    };
    // Rigid grains take long steps, in which they go far.
    let margin = solver.margin.unwrap_or(if solver.method == schema::Method::Dem { 0.2 } else { 1.0 });
    let solver = Solver {
        method,
        dt,
        allow_unstable: solver.allow_unstable,
        allow_overlap: solver.allow_overlap,
        damping,
        adaptive_damping,
        margin,
        twist: solver.twist,
    };
    check_solver(&solver, check)?;
    Ok(solver)
}

/// Of the stability bound: a step that follows collisions, and one that only has to be stable.
const DT_FRACTION: f64 = 0.15;
const ADAPTIVE_FRACTION: f64 = 0.7;

/// The numbers of a method.
pub fn check_solver(solver: &Solver, check: &Check) -> Result<()> {
    if let Method::ContactDynamics(relaxation) = &solver.method {
        if solver.twist == Twist::Followed {
            return Err(check
                .origin
                .wrong("solver.twist", "is for method = \"dem\" only; rigid grains have no springs"));
        }
        relaxation.solver.check_built().map_err(|error| check.origin.wrong("solver.relaxation", error))?;
        check.positive("solver.tolerance", relaxation.tolerance, "")?;
        if relaxation.max_iterations == 0 {
            return Err(check.origin.bad("solver.max_iterations", 0, "must be at least 1"));
        }
        if let Some(speed) = relaxation.max_correction_velocity {
            check.not_negative("solver.max_correction_velocity", speed, " of m/s")?;
            if relaxation.compliant {
                let message = "is for rigid contacts; with compliance springs open overlaps";
                return Err(check.origin.wrong("solver.max_correction_velocity", message));
            }
        }
    }
    match solver.dt {
        TimeStep::Fixed(dt) => check.positive("solver.dt", dt, " of s, or \"auto\"")?,
        TimeStep::Auto { fraction } => check.fraction("solver.dt_fraction", fraction)?,
    };
    check.not_negative("solver.damping", solver.damping, " of 1/s")?;
    if solver.adaptive_damping && (solver.damping != 0.0 || solver.method != Method::DiscreteElements) {
        return Err(check
            .origin
            .wrong("solver.damping", "\"adaptive\" is for method = \"dem\" only, and no number beside it"));
    }
    check.within("solver.margin", solver.margin, 1e-3, 10.0, " mean radii")?;
    Ok(())
}

/// What the word at a key of the solver stands for.
fn word<T: FromStr<Err = Error>>(key: &str, given: Option<&str>, default: T, check: &Check) -> Result<T> {
    let Some(given) = given else { return Ok(default) };
    given.parse().map_err(|error: Error| check.origin.wrong(&format!("solver.{key}"), error))
}

/// The method, with the numbers of its own.
fn method(solver: &schema::Solver, check: &Check) -> Result<Method> {
    let own = [
        ("relaxation", solver.relaxation.is_some()),
        ("order", solver.order.is_some()),
        ("tolerance", solver.tolerance.is_some()),
        ("max_iterations", solver.max_iterations.is_some()),
        ("max_correction_velocity", solver.max_correction_velocity.is_some()),
        ("compliance", solver.compliance.is_some()),
        ("gyroscopic", solver.gyroscopic.is_some()),
    ];
    if solver.method == schema::Method::Dem {
        return match own.iter().find(|(_, given)| *given) {
            Some((key, _)) => Err(check.origin.wrong(&format!("solver.{key}"), "is for method = \"cd\" only")),
            None => Ok(Method::DiscreteElements),
        };
    }
    Ok(Method::ContactDynamics(Relaxation {
        solver: word("relaxation", solver.relaxation.as_deref(), solve::Solver::JacobiAccelerated, check)?,
        order: word("order", solver.order.as_deref(), solve::Order::default(), check)?,
        tolerance: solver.tolerance.unwrap_or(1e-5),
        max_iterations: solver.max_iterations.unwrap_or(1000),
        max_correction_velocity: solver.max_correction_velocity,
        compliant: solver.compliance.as_ref().is_some_and(|compliance| !compliance.is_none()),
        gyroscopic: solver.gyroscopic.unwrap_or(false),
    }))
}

fn stop(stop: &schema::Stop, jamming: Option<&schema::Jamming>, check: &Check) -> Result<Stop> {
    let usual = JammingProtocol::default();
    let protocol = |given: &schema::Jamming| JammingProtocol {
        step: given.step.unwrap_or(usual.step),
        tolerance: given.tolerance.unwrap_or(usual.tolerance),
        residual: given.residual.unwrap_or(usual.residual),
        relaxation_steps: given.relaxation_steps.unwrap_or(usual.relaxation_steps),
    };
    let stop = Stop {
        jamming: jamming.map(protocol),
        time: stop.time,
        steps: stop.steps,
        equilibrium: stop.equilibrium,
        strain: stop.strain.array(),
        packing_fraction: stop.packing_fraction,
        pressure: stop.pressure,
    };
    check_stop(&stop, check)?;
    if stop == Stop::default() {
        let message = "the scene never ends; give at least one of time, steps, equilibrium and, of a cell that deforms or whose grains grow, strain, packing_fraction and pressure, or [jamming]";
        return Err(check.origin.wrong("stop", message));
    }
    Ok(stop)
}

/// Conditions that a run can meet.
pub fn check_stop(stop: &Stop, check: &Check) -> Result<()> {
    if let Some(time) = stop.time {
        check.positive("stop.time", time, " of s")?;
    }
    if stop.steps == Some(0) {
        return Err(check.origin.bad("stop.steps", 0, "must be at least 1"));
    }
    if let Some(ratio) = stop.equilibrium {
        check.positive("stop.equilibrium", ratio, "")?;
    }
    if let Some(pressure) = stop.pressure {
        check.positive("stop.pressure", pressure, " of Pa (N/m in two dimensions)")?;
    }
    Ok(())
}

fn output(output: &schema::Output, check: &Check) -> Result<Output> {
    let wanted = |format| output.formats.contains(&format);
    let output = Output {
        history: output.history,
        snapshots: output.snapshots,
        checkpoint: output.checkpoint,
        works: output.works,
        csv: wanted(Format::Csv),
        bin: wanted(Format::Bin),
        vtp: wanted(Format::Vtp),
        contacts_csv: wanted(Format::ContactsCsv),
        contacts_vtp: wanted(Format::ContactsVtp),
        npz: wanted(Format::Npz),
        xyz: wanted(Format::Xyz),
        dump: wanted(Format::Dump),
    };
    check_output(&output, check)?;
    Ok(output)
}

/// Intervals between what a run writes.
pub fn check_output(output: &Output, check: &Check) -> Result<()> {
    if let Some(interval) = output.history {
        check.positive("output.history", interval, " of s")?;
    }
    if let Some(interval) = output.snapshots {
        check.positive("output.snapshots", interval, " of s")?;
    }
    check.not_negative("output.checkpoint", output.checkpoint, " of s")?;
    Ok(())
}

/// Single grains first, then the populations, in the order of the file, those that come in over time last.
fn grains(file: &File, site: &Site, bodies: &mut Bodies, check: &Check) -> Result<Vec<Waiting>> {
    for (number, grain) in file.grain.iter().enumerate() {
        let placed = single(grain, &format!("grain.{number}"), &mut bodies.shapes, check)?;
        bodies.append(placed);
    }
    let make = |number: usize, bodies: &mut Bodies| populate(&file.population[number], number, site, bodies, check);
    let waiting = populate_over_time(file, bodies, make)?;
    check_count(bodies.grains.len(), check)?;
    Ok(waiting)
}

/// There must be grains, and indices of 32 bits for them.
pub fn check_count(grains: usize, check: &Check) -> Result<()> {
    if grains == 0 {
        let message = "the scene has no grains; add a [[grain]] or a [[population]]";
        return Err(check.origin.wrong("grain", message));
    }
    if u32::try_from(grains).is_err() {
        return Err(check.origin.wrong("population", "too many grains"));
    }
    Ok(())
}

fn single(grain: &schema::Grain, key: &str, shapes: &mut Shapes, check: &Check) -> Result<Placed> {
    let at = |field: &str| format!("{key}.{field}");
    let spin = match (check.dimension, &grain.spin) {
        (_, None) => DVec3::ZERO,
        (2, Some(Spin::Plane(spin))) => DVec3::new(0.0, 0.0, *spin),
        (3, Some(Spin::Space(spin))) => DVec3::from_array(*spin),
        (2, _) => {
            let message = "must be one number of rad/s (dimension = 2)";
            return Err(check.origin.wrong(&at("spin"), message));
        }
        _ => {
            let message = "must have 3 numbers of rad/s (dimension = 3)";
            return Err(check.origin.wrong(&at("spin"), message));
        }
    };
    let radius = check.positive(&at("radius"), grain.radius, " of m")?;
    let material = check.material(&at("material"), &grain.material)?;
    check.body(&at("radius"), radius, material)?;
    let shape = grain.shape.as_ref().map(|name| shapes.named(|| at("shape"), name)).transpose()?;
    let attitude = grain.orientation.as_ref().map(|given| orientation(given, &at("orientation"), check)).transpose()?;
    let pose = match (shape, attitude) {
        (None, Some(_)) => return Err(check.origin.wrong(&at("orientation"), "goes with `shape` only")),
        (_, Some(None)) => {
            let rule = "is for populations; a single grain has one orientation";
            return Err(check.origin.bad(&at("orientation"), "\"random\"", rule));
        }
        (shape, attitude) => {
            shape.map(|shape| Pose { shape, orientation: attitude.flatten().unwrap_or(DQuat::IDENTITY) })
        }
    };
    let grain = Grain {
        position: check.vector(&at("position"), &grain.position)?,
        velocity: check.vector_or_zero(&at("velocity"), grain.velocity.as_deref())?,
        spin,
        radius: radius * check.initial[material as usize],
        material,
        fixed: grain.fixed,
    };
    Ok(Placed { grains: vec![grain], poses: pose.map(|pose| vec![pose]), numbers: None })
}

/// The two ends of a period are the same place; the rest of the crate expects the lower one.
pub fn fold_ends(grains: &mut [Grain], clumps: &mut [Clump], domain: &Domain) {
    let positions = grains.iter_mut().map(|g| &mut g.position).chain(clumps.iter_mut().map(|c| &mut c.position));
    for position in positions {
        for axis in (0..3).filter(|axis| domain.periodic[*axis]) {
            if position[axis] == domain.upper[axis] {
                position[axis] = domain.lower[axis];
            }
        }
    }
}

/// Checks the start as a whole: domain, walls, overlaps.
pub fn check_start(assembly: &Assembly, check: &Check) -> Result<()> {
    check_growth(assembly, check)?;
    check_cell(assembly, check)?;
    check_adaptive_damping(assembly, check)?;
    let smallest = assembly.grains.iter().map(|grain| grain.radius).fold(f64::INFINITY, f64::min);
    check_apart(&assembly.walls, smallest, check)?;
    check_areas(assembly, check)?;
    check_clumps(assembly, check)?;
    check_grains(assembly, check)
}

/// What damping that adapts itself cannot do.
fn check_adaptive_damping(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { solver, clumps, output, .. } = assembly;
    let lacking = match () {
        () if !solver.adaptive_damping => return Ok(()),
        () if !clumps.is_empty() => "is for spheres and disks; give clumps a number of 1/s",
        () if output.works => "takes away what output.works would have to add up; leave one of them out",
        () => return Ok(()),
    };
    Err(check.origin.bad("solver.damping", "\"adaptive\"", lacking))
}

/// Clumps as wholes: in the domain, and too small to meet themselves around a period.
fn check_clumps(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { clumps, shapes, domain, numbers, .. } = assembly;
    for (k, clump) in clumps.iter().enumerate() {
        let id = numbers.of_clump(k);
        let shape = &shapes[clump.shape as usize];
        for axis in (0..check.dimension).filter(|axis| domain.periodic[*axis]) {
            let (low, high) = (domain.lower[axis], domain.upper[axis]);
            let least = clump.least_period(shape);
            if high - low < least {
                let message = format!(
                    "the periodic axis {} is {} m long, must be at least {} m for a clump of shape \"{}\" and size {} m",
                    AXES[axis],
                    show(high - low),
                    show(least),
                    shape.name,
                    show(clump.radius)
                );
                return Err(check.origin.wrong("domain", message));
            }
        }
        check_in_domain("clump", id, clump.position, domain, [true; 3], check)?;
    }
    Ok(())
}

fn check_grains(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { domain, walls, grains, clumps, numbers, solver: Solver { allow_overlap, .. }, .. } = assembly;
    let largest = assembly.whole().grains.iter().map(|grain| grain.radius).fold(0.0, f64::max);
    check_periods(domain, largest, check)?;
    // Members may stand out of a period that the centre of their clump is in.
    let bounded = domain.periodic.map(|periodic| !periodic || clumps.is_empty());
    let place = |(k, grain): (usize, &Grain)| {
        let id = numbers.of_grain(k);
        check_in_domain("grain", id, grain.position, domain, bounded, check)?;
        walls.iter().try_for_each(|wall| check_at_wall(id, grain, wall, *allow_overlap, check))
    };
    first_error(grains.par_iter().enumerate().map(place))?;
    match allow_overlap {
        true => Ok(()),
        false => check_overlaps(assembly, check),
    }
}

/// The first of many checks that fails.
pub fn first_error(checks: impl IndexedParallelIterator<Item = Result<()>>) -> Result<()> {
    checks.find_map_first(Result::err).map_or(Ok(()), Err)
}

impl Assembly {
    /// Periods must not be shorter, m: a grain, and a clump, must not meet two images of the same neighbour.
    pub(crate) fn narrowest(&self) -> f64 {
        let of_clump = |clump: &Clump| clump.least_period(&self.shapes[clump.shape as usize]);
        let of_clumps = self.clumps.iter().map(of_clump);
        self.grains.iter().map(|grain| 4.0 * grain.radius).chain(of_clumps).fold(0.0, f64::max)
    }
}

impl Clump {
    /// A clump of this shape must not meet itself around a period of this length, m.
    fn least_period(&self, shape: &Shape) -> f64 {
        let widest = shape.members.iter().map(|m| m.radius).fold(0.0, f64::max);
        2.0 * self.radius * (shape.reach() + widest)
    }
}

/// A grain must not meet two images of the same neighbour.
fn check_periods(domain: &Domain, largest: f64, check: &Check) -> Result<()> {
    for axis in (0..check.dimension).filter(|&axis| domain.periodic[axis]) {
        let length = domain.upper[axis] - domain.lower[axis];
        if length < 4.0 * largest {
            let message = format!(
                "the periodic axis {} is {} m long, must be at least 4 largest radii, {} m",
                AXES[axis],
                show(length),
                show(4.0 * largest)
            );
            return Err(check.origin.wrong("domain", message));
        }
    }
    Ok(())
}

fn check_in_domain(
    what: &str,
    id: u32,
    position: DVec3,
    domain: &Domain,
    bounded: [bool; 3],
    check: &Check,
) -> Result<()> {
    for (axis, name) in AXES.iter().enumerate().filter(|(axis, _)| bounded[*axis]) {
        let (low, high) = (domain.lower[axis], domain.upper[axis]);
        if !(low..=high).contains(&position[axis]) {
            let message = format!(
                "{what} {id} at {} is outside the domain: {name} must be from {} to {}",
                show_vector(position, check.dimension),
                show(low),
                show(high)
            );
            return Err(check.origin.wrong("domain", message));
        }
    }
    Ok(())
}

fn check_at_wall(id: u32, grain: &Grain, wall: &Wall, allow_overlap: bool, check: &Check) -> Result<()> {
    let distance = wall.surface.distance(grain.position);
    let place = || show_vector(grain.position, check.dimension);
    if distance < 0.0 {
        let message =
            format!("grain {id} at {} is beyond the wall \"{}\" by {} m", place(), wall.name, show(-distance));
        return Err(check.origin.wrong("wall", message));
    }
    let overlap = grain.radius - distance;
    // Fixed grains may be set into a wall to roughen it.
    if overlap > OVERLAP * grain.radius && !allow_overlap && !grain.fixed {
        let message = format!(
            "grain {id} at {} overlaps the wall \"{}\" by {} m, more than 10 % of its radius {} m; move it or set solver.allow_overlap = true",
            place(),
            wall.name,
            show(overlap),
            show(grain.radius)
        );
        return Err(check.origin.wrong("wall", message));
    }
    Ok(())
}

impl Assembly {
    /// The largest overlap of free grains with others and with walls, over the radius of the smaller one.
    pub(crate) fn largest_overlap(&self) -> f64 {
        let grains = &self.grains[..self.grains.len() - self.waiting];
        let owners = self.owners();
        let neighbours = Neighbours::of_grains(self.domain, self.dimension, grains);
        let of_grain = |(id, grain): (usize, &Grain)| {
            let mut deepest = 0.0_f64;
            neighbours.find_overlap(grain.position, grain.radius, true, |other, overlap| {
                let apart = other != id && (owners.is_empty() || owners[other] != owners[id]);
                if apart && !(grain.fixed && grains[other].fixed) {
                    deepest = deepest.max(overlap / grain.radius.min(grains[other].radius));
                }
                false
            });
            let walls = self.walls.iter().map(|wall| 1.0 - wall.surface.distance(grain.position) / grain.radius);
            if grain.fixed { deepest } else { walls.fold(deepest, f64::max) }
        };
        grains.par_iter().enumerate().map(of_grain).reduce(|| 0.0, f64::max)
    }
}

fn check_overlaps(assembly: &Assembly, check: &Check) -> Result<()> {
    let Assembly { grains, clumps, domain, numbers, .. } = assembly;
    // Members of a clump may overlap as they like.
    let owner = |id: usize| clumps.partition_point(|clump| clump.first as usize <= id);
    let together = |a: usize, b: usize| !clumps.is_empty() && owner(a) == owner(b);
    let neighbours = Neighbours::of_grains(*domain, check.dimension, grains);
    // Each pair is found from its smaller grain, so that no grain has to visit many small ones.
    let found = grains.par_iter().enumerate().find_map_first(|(id, grain)| {
        let deep = |other: usize, overlap: f64| {
            let smaller = grain.radius.min(grains[other].radius);
            let both_fixed = grain.fixed && grains[other].fixed;
            other != id && !both_fixed && overlap > OVERLAP * smaller && !together(id, other)
        };
        let (other, overlap) = neighbours.find_overlap(grain.position, grain.radius, true, deep)?;
        Some((id.min(other), id.max(other), overlap))
    });
    let Some((a, b, overlap)) = found else {
        return Ok(());
    };
    let message = format!(
        "grains {} and {} overlap by {} m, more than 10 % of the smaller radius {} m; move them or set solver.allow_overlap = true",
        numbers.of_grain(a),
        numbers.of_grain(b),
        show(overlap),
        show(grains[a].radius.min(grains[b].radius))
    );
    Err(check.origin.wrong("grain", message))
}
