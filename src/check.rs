//! CPU and GPU side by side, stage by stage.
//!
//! The device's state drives. Before each stage both engines hold the same numbers (what the device holds is exact in
//! f64); both run the stage; what the device wrote is compared with what the twin wrote, and then adopted by the twin.
//! So every row of the report is the rounding of one stage, not the drift of a trajectory.

use crate::{
    engine::{Engine, Gpu, cpu::apply},
    error::{Error, Result},
    kernels::Stage,
    laws::{
        boundary::between,
        contact::way_to,
        grains::{labels, same_grain},
        grid::for_candidates,
        materials::pair_of,
        normal::normal_force,
        precision::residue_of,
        touch::touch_grain,
        walls::touch_wall,
    },
    measure::Sample,
    model::{Method, Precision},
    plan::{Op, Plan},
    scene::Assembly,
    simulation::{EngineChoice, Options, Setup, Simulation},
    state::{ARRAYS, Effort, Element, INDEX, Length, Motion, NONE, Part, State, Wall},
};
use glam::DVec3;
use serde::Serialize;

/// The outcome of a check.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    pub adapter: String,
    pub precision: &'static str,
    /// Steps compared, and steps done before the comparison began.
    pub steps: u64,
    pub after: u64,
    /// Largest number of contacts seen: a check without contacts checks little.
    pub contacts: u64,
    pub rows: Vec<Row>,
    /// How far both engines drift apart when they run the same steps freely, largest distance over mean radius. For
    /// information: in a collision every difference grows.
    pub trajectory: f64,
    pub passed: bool,
}

/// One array written by one stage, worst over all calls.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub stage: &'static str,
    pub array: &'static str,
    /// Numbers: largest difference over the largest value. Integers: the fraction that differs.
    pub worst: f64,
    /// Numbers: root mean square of the difference over that of the values.
    pub rms: f64,
    pub tolerance: f64,
    pub calls: u64,
    pub passed: bool,
}

/// Passes of contact dynamics that are compared in a step.
const PASSES: usize = 8;

/// Unit round-off of a precision.
fn epsilon(precision: Precision) -> f64 {
    match precision {
        Precision::Single => f64::from(f32::EPSILON),
        Precision::Double => f64::EPSILON,
    }
}

/// Compare `steps` steps stage by stage, after the device has done `after` steps on its own. Whatever engine `options`
/// name, both are run.
///
/// # Errors
/// As [`Simulation::new`] on the GPU engine, and whatever stops a run.
pub fn check(assembly: &Assembly, options: Options, after: u64, steps: u64) -> Result<Report> {
    let precision = options.precision;
    let options = Options { engine: EngineChoice::Gpu, ..options };
    let mut simulation = Simulation::new(assembly.clone(), options)?;
    simulation.advance(after)?;
    let present: Vec<&'static str> = ARRAYS.iter().filter(|a| (a.needed)(simulation.model())).map(|a| a.name).collect();
    let mut state = simulation.read(&present)?.clone();
    if simulation.step() == 0 {
        state.params.since = 0.0;
    }
    let plan = Setup::new(assembly, &options)?.plan;
    // The device's parameters are rounded to its precision; the twin must be asked about the same ones.
    if precision == Precision::Single {
        state.params = state.params.rounded(state.model.dims());
    }
    let bodies = state.sizes.bodies;
    for array in ["force", "torque"].into_iter().filter(|a| present.contains(a)) {
        state.column_mut(array).resize(bodies);
    }
    let device = simulation.engine().gpu().expect("a simulation on the device");
    let mut gpu = device.beside(&state)?;

    let mut checker = Checker { gpu: &mut gpu, state: &mut state, precision, present, rows: Vec::new(), contacts: 0 };
    for step in 0..steps {
        // Steps of rigid grains are long: every one gets lists of its own.
        if step == 0 || checker.state.halt[0] != 0 || !plan.meet.is_empty() {
            checker.run(&plan.begin)?;
            checker.run(&plan.sort)?;
            checker.run(&plan.list)?;
        }
        checker.run(&plan.sample)?;
        checker.run(&plan.forces)?;
        checker.run(&plan.synchronise)?;
        checker.run(&plan.meet)?;
        checker.run(&plan.seed)?;
        (0..PASSES).try_for_each(|_| checker.run(&plan.probe))?;
        checker.run(&plan.meet)?;
        checker.colour(&plan)?;
        for _ in 0..PASSES {
            let colours = checker.state.palette.first().map_or(0, |palette| palette.colours);
            (0..colours).try_for_each(|_| checker.run(&plan.sweep))?;
            checker.run(&plan.relax)?;
        }
        checker.run(&plan.judge)?;
        checker.run(&plan.step)?;
        checker.state.params.since = checker.state.params.dt;
    }
    checker.run(&plan.survey)?;
    let Checker { rows, contacts, .. } = checker;

    let passed = rows.iter().all(|r| r.passed);
    let trajectory = trajectory(simulation, options, steps)?;
    let precision = precision.label();
    Ok(Report { adapter: gpu.adapter(), precision, steps, after, contacts, rows, trajectory, passed })
}

/// How far a simulation on the device is from one on the CPU, after so many more steps.
fn trajectory(mut on_gpu: Simulation, options: Options, steps: u64) -> Result<f64> {
    on_gpu.advance(steps)?;
    let mut on_cpu = Simulation::new(on_gpu.assembly().clone(), Options { engine: EngineChoice::Cpu, ..options })?;
    on_cpu.advance(on_gpu.step())?;
    let (gpu, cpu) = (on_gpu.grains()?, on_cpu.grains()?);
    let domain = &on_gpu.assembly().domain;
    let mean_radius = cpu.iter().map(|g| g.radius).sum::<f64>() / cpu.len() as f64;
    let nearest = |mut d: glam::DVec3| {
        for axis in (0..3).filter(|a| domain.periodic[*a]) {
            let length = domain.upper[axis] - domain.lower[axis];
            d[axis] -= length * (d[axis] / length).round();
        }
        d.length()
    };
    let distance = gpu.iter().zip(&cpu).map(|(a, b)| nearest(a.position - b.position));
    Ok(distance.fold(0.0, f64::max) / mean_radius)
}

struct Checker<'a> {
    gpu: &'a mut Gpu,
    state: &'a mut State,
    precision: Precision,
    present: Vec<&'static str>,
    rows: Vec<Row>,
    contacts: u64,
}

impl Checker<'_> {
    fn run(&mut self, ops: &[Op]) -> Result<()> {
        ops.iter().try_for_each(|op| self.op(op))
    }

    /// Colours for all contacts, if contacts are updated by colours.
    fn colour(&mut self, plan: &Plan) -> Result<()> {
        self.run(&plan.bleach)?;
        let mut coloured = 0;
        while !plan.colour.is_empty() {
            self.run(&plan.colour)?;
            self.run(&plan.colour[..1])?;
            let palette = self.state.palette[0];
            if self.state.sizes.make_room(&palette) {
                for array in ARRAYS.iter().filter(|a| matches!(a.length, Length::Contacts | Length::Colours)) {
                    self.grow(&[array.name], self.state.sizes.of(array.length))?;
                }
                self.run(&plan.bleach)?;
            } else if palette.uncoloured == 0 {
                break;
            } else if palette.contacts == coloured {
                return Err(Error::Device("the contacts cannot be coloured".to_owned()));
            }
            coloured = palette.contacts;
        }
        self.run(&plan.arrange)
    }

    fn op(&mut self, op: &Op) -> Result<()> {
        let params = self.state.params;
        // Arrays may have to grow; a check that runs out of slots would compare two refusals.
        let bodies = self.state.sizes.bodies;
        match op {
            Op::Run(stage) if stage.name == "neighbours" => {
                let lists = ARRAYS.iter().filter(|a| a.length == Length::Slots).map(|a| a.name).collect::<Vec<_>>();
                self.grow(&lists, self.state.slot_start[bodies] as usize)?;
            }
            Op::Run(stage) if stage.name == "remember" => {
                self.grow(&["history_other", "history_spring"], self.state.history_start[bodies] as usize)?;
            }
            _ => {}
        }
        self.gpu.execute(&params, &[(std::slice::from_ref(op), 1)])?;
        let Op::Run(stage) = op else {
            apply(op, self.state);
            return Ok(());
        };
        let undecided = match stage.name {
            "advance" | "forces" | "synchronise" | "measure" | "load" => undecided(self.state, self.precision),
            "synchronise_clumps" | "measure_clumps" => undecided_clumps(self.state, self.precision),
            "count" | "neighbours" => at_the_reach(self.state, self.precision),
            _ => Vec::new(),
        };
        let overlap = deepest(self.state);
        (stage.twin)(self.state);
        let written: Vec<&'static str> = self.gpu.written(stage).to_vec();
        let mut device = self.state.clone();
        self.gpu.read(&written, &mut device)?;
        for &array in &written {
            let tolerance = self.tolerance(stage, array, overlap);
            let (worst, rms) = compare(self.state, &device, stage, array, &undecided);
            self.record(stage, array, worst, rms, tolerance);
        }
        for array in written {
            self.state.column_mut(array).replace(device.column(array).duplicate());
        }
        if stage.name == "measure" {
            let bodies = self.state.sizes.bodies;
            self.contacts = self.contacts.max(Sample::new(0, 0.0, bodies, &self.state.part).contacts);
        }
        Ok(())
    }

    fn grow(&mut self, arrays: &[&'static str], needed: usize) -> Result<()> {
        for array in arrays.iter().filter(|a| self.present.contains(a)) {
            if needed > self.state.column(array).len() {
                self.gpu.resize(array, needed)?;
                self.state.column_mut(array).resize(needed);
            }
        }
        Ok(())
    }

    /// A few roundings of the largest term; integers are exact. In double precision a gap is the difference of a distance
    /// and two radii, so what depends on forces loses as many digits as the overlap is smaller than a grain.
    fn tolerance(&self, stage: &Stage, array: &str, overlap: f64) -> f64 {
        let epsilon = epsilon(self.precision);
        match (stage.name, array) {
            (
                "advance" | "load" | "forces" | "synchronise" | "synchronise_clumps" | "measure" | "measure_clumps",
                _,
            ) if overlap > 0.0 && self.precision == Precision::Double => 16.0 * epsilon * (1.0 / overlap).max(1.0),
            // Sums of small differences, some of either sign.
            ("relax" | "follow" | "fall_in" | "judge" | "probe" | "respond_first" | "respond", "effort") => {
                1e4 * epsilon
            }
            _ => 64.0 * epsilon,
        }
    }

    fn record(&mut self, stage: &Stage, array: &'static str, worst: f64, rms: f64, tolerance: f64) {
        let passed = worst <= tolerance;
        match self.rows.iter_mut().find(|r| r.stage == stage.name && r.array == array) {
            Some(row) => {
                // The call that came closest to its tolerance speaks for the row.
                if worst * row.tolerance >= row.worst * tolerance {
                    (row.worst, row.rms, row.tolerance) = (worst, rms, tolerance);
                }
                row.calls += 1;
                row.passed &= passed;
            }
            None => self.rows.push(Row { stage: stage.name, array, worst, rms, tolerance, calls: 1, passed }),
        }
    }
}

/// A list entry: overlap over the sum of radii, > 0 where surfaces touch, and the force of the normal spring, N.
struct Entry {
    overlap: f64,
    force: f64,
}

/// The list entries of grain i.
fn entries(s: &State, i: usize) -> impl Iterator<Item = Entry> {
    let slots = s.slot_start[i] as usize..(s.slot_start[i + 1] as usize).min(s.neighbour.len());
    let bodies = s.sizes.bodies;
    let here = &s.place[i];
    let entries = s.neighbour[slots.start.min(slots.end)..slots.end].iter().take_while(|entry| **entry != NONE);
    entries.map(|entry| (entry & INDEX) as usize).filter(move |j| *j < bodies + s.sizes.walls).map(move |j| {
        let (gap, size) = if j < bodies {
            let there = &s.place[j];
            let rest = residue_of(s, i).radius + residue_of(s, j).radius;
            let touch = touch_grain(way_to(s, i, j), here.radius, there.radius, rest);
            (touch.gap, here.radius + there.radius)
        } else {
            (touch_wall(&s.wall[j - bodies], here, residue_of(s, i)).gap, here.radius)
        };
        Entry { overlap: -gap / size, force: normal_force(&pair_of(s, i, j), gap.min(0.0)) }
    })
}

/// Grains with a contact so close to opening that rounding decides whether it is one. With a dashpot the force jumps
/// there, so no tolerance can hold for them.
fn undecided(s: &State, precision: Precision) -> Vec<bool> {
    let limit = 16.0 * epsilon(precision);
    (0..s.sizes.bodies).map(|i| entries(s, i).any(|e| e.overlap.abs() < limit)).collect()
}

/// Clumps with such a member.
fn undecided_clumps(s: &State, precision: Precision) -> Vec<bool> {
    let members = undecided(s, precision);
    (0..s.sizes.clumps).map(|c| labels(s, c).any(|label| members[s.whereabouts[label] as usize])).collect()
}

/// Grains with a neighbour so close to the reach of the lists that rounding decides whether it is listed.
fn at_the_reach(s: &State, precision: Precision) -> Vec<bool> {
    let rounding = 16.0 * epsilon(precision);
    let margin = s.params.margin;
    let grain = |i: usize, j: usize| {
        let reach = s.place[i].radius + s.place[j].radius + margin + s.params.blur;
        let distance = between(s, s.place[i].x, s.place[j].x, DVec3::ZERO).x.length();
        let slack = 1e-5 * s.place[i].radius;
        [0.0, slack].iter().any(|more| (distance - (reach + more)).abs() < rounding * reach)
    };
    let wall = |i: usize, wall: &Wall| {
        let here = &s.place[i];
        let gap = touch_wall(wall, here, residue_of(s, i)).gap;
        let scale = (here.x - wall.point).length() + here.radius;
        [1.0, 2.0].iter().any(|reach| (gap - reach * margin).abs() < rounding * scale)
    };
    let near = |i: usize| {
        let mut near = false;
        for_candidates(s, s.place[i].x, |j| near |= !same_grain(s, i, j) && grain(i, j));
        near
    };
    (0..s.sizes.bodies).map(|i| near(i) || s.wall[..s.sizes.walls].iter().any(|w| wall(i, w))).collect()
}

/// The deepest overlap over the sum of radii.
fn deepest(s: &State) -> f64 {
    (0..s.sizes.bodies).flat_map(|i| entries(s, i)).map(|e| e.overlap).fold(0.0, f64::max)
}

/// Worst and RMS relative difference of an array between twin and device.
fn compare(twin: &State, device: &State, stage: &Stage, array: &str, undecided: &[bool]) -> (f64, f64) {
    let dims = twin.model.dims();
    let lanes = |s: &State| {
        let mut lanes = Vec::new();
        s.column(array).lanes(dims, &mut |x| lanes.push(x));
        lanes
    };
    match array {
        "residue_next" => return positions(twin, device, undecided),
        "attitude_next" if twin.model.precision == Precision::Single => return attitudes(twin, device),
        "rounds" => return rounds(twin, device),
        "center_residue_next" => return centers(twin, device),
        "attitude_residue_next" => return attitudes(twin, device),
        _ => {}
    }
    let (mut a, mut b) = (lanes(twin), lanes(device));
    if stage.unordered.contains(&array) {
        a.sort_by(f64::total_cmp);
        b.sort_by(f64::total_cmp);
    }
    if array == "counters" {
        return counters(&a, &b);
    }
    let width = a.len() / twin.column(array).len().max(1);
    let masked = |k: usize| match (stage.name, array) {
        (
            "advance" | "forces" | "synchronise",
            "force" | "torque" | "motion_next" | "spin_next" | "place_next" | "travel",
        ) => undecided[k / width],
        ("count", "slot_start") => undecided.get(k).is_some_and(|u| *u),
        ("load", "pull" | "twist") | ("synchronise_clumps", "clump_motion_next" | "clump_spin_next") => {
            undecided[k / width]
        }
        ("synchronise_clumps", _) => undecided[twin.owner[twin.number[k / width] as usize] as usize],
        ("measure_clumps", _) => (k / width..undecided.len()).step_by(crate::state::PARTS).any(|c| undecided[c]),
        ("advance" | "load" | "neighbours", "spring" | "neighbour") => undecided[owner(twin, k / width)],
        ("measure", _) => (k / width..undecided.len()).step_by(crate::state::PARTS).any(|i| undecided[i]),
        _ => false,
    };
    let integer = twin.column(array).integer();
    if integer {
        let different = (0..a.len()).filter(|k| a[*k] != b[*k] && !masked(*k)).count();
        return (different as f64 / a.len() as f64, 0.0);
    }
    // What a contact makes inherits the rounding of its normal force, however small it is itself: at rest, forces of
    // many times a grain's weight balance to it.
    let contact_force = || (0..twin.sizes.bodies).flat_map(|i| entries(twin, i)).map(|e| e.force).fold(0.0, f64::max);
    let floor = match (stage.name, array) {
        ("advance" | "load" | "forces", "force" | "spring" | "pull") => contact_force(),
        ("load" | "forces", "torque" | "twist") => {
            contact_force() * twin.place.iter().map(|p| p.radius).fold(0.0, f64::max)
        }
        // A residue is what is left of a step when whole quanta are taken off.
        ("move_walls", "wall") => {
            let step = |wall: &Wall| twin.params.dt * wall.velocity.length();
            twin.wall.iter().map(step).fold(twin.params.quantum, f64::max)
        }
        // Grains that start from rest are at rest again when half a step is taken back.
        ("synchronise" | "synchronise_clumps", "motion_next" | "clump_motion_next") => {
            twin.params.dt * twin.params.gravity.length()
        }
        // Friction at the Coulomb limit is beyond it by rounding.
        ("judge", "effort") => twin.effort.iter().map(|e| e.pressing).fold(0.0, f64::max),
        // Squares of what is left where velocities cancel: d(x²) = 2 x dx, and dx is a rounding of velocities.
        ("sweep", "miss") => {
            let v = twin.ahead.iter().map(|m| m.v.length()).fold(0.0, f64::max);
            let left = twin.miss.iter().copied().fold(0.0, f64::max).sqrt();
            2.0 * v * left.max(64.0 * epsilon(twin.model.precision) * v)
        }
        (
            "respond_first" | "respond" | "echo" | "recover" | "displace_clumps",
            "trial_spin" | "trial_spin_before" | "ahead_spin" | "clump_spin_next",
        ) => spin_floor(twin),
        _ => 0.0,
    };
    // Members of a record have different units, so each is compared with its own largest value; vectors as a whole.
    let mut result = (0.0_f64, 0.0_f64);
    for (member, members) in member_lanes(twin, array, width).into_iter().enumerate() {
        let floor = match array {
            "part" => floor.max(part_floor(twin, member)),
            "effort" => floor.max(effort_floor(twin, Effort::names(3)[member])),
            _ => floor,
        };
        let (mut worst, mut largest, mut squares, mut scale) = (0.0_f64, floor, 0.0, 0.0);
        for k in (0..a.len()).filter(|k| members.contains(&(k % width)) && !masked(*k)) {
            let difference = (a[k] - b[k]).abs();
            // NaN must fail, and f64::max would swallow it.
            worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
            largest = largest.max(a[k].abs());
            squares += difference * difference;
            scale += a[k] * a[k];
        }
        let relative = |d: f64, of: f64| if d == 0.0 { 0.0 } else { d / of };
        result.0 = result.0.max(relative(worst, largest));
        let own = scale.sqrt().max(floor * (a.len() as f64).sqrt());
        result.1 = result.1.max(relative(squares.sqrt(), own));
    }
    result
}

/// What sums over contacts that are solved may differ by for a member of [`Effort`]: the square of the rounding of velocities,
/// (m/s)², and the energy of that, J.
fn effort_floor(s: &State, member: &str) -> f64 {
    let squares = |of: fn(&Motion) -> f64| s.ahead.iter().map(of).fold(0.0, f64::max) * epsilon(s.model.precision);
    match member {
        "residual" => squares(|m| m.v.length_squared()),
        "turn" | "work" | "way" => {
            squares(|m| if m.inverse_mass == 0.0 { 0.0 } else { m.v.length_squared() / m.inverse_mass })
        }
        _ => 0.0,
    }
}

/// Spins of clumps are sums of what single members give them, and these may nearly cancel: the largest of them, rad/s.
fn spin_floor(s: &State) -> f64 {
    let of_member = |label: usize| {
        let (i, c) = (s.whereabouts[label] as usize, s.owner[label] as usize);
        s.inverse_moments[c].0.max_element() * (s.offset[label].0.length() * s.pull[i].length() + s.twist[i].0.length())
    };
    (0..s.sizes.bodies).map(of_member).fold(0.0, f64::max)
}

/// What sums over grains at rest may differ by for a member of [`Part`]: the energy, J, that gravity gives the heaviest in a step,
/// what global damping takes of it, W, and in contact dynamics the contact forces that balance, N.
fn part_floor(s: &State, member: usize) -> f64 {
    let lightest = s.motion.iter().map(|m| m.inverse_mass).filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
    let kinetic = 0.5 * (s.params.gravity.length() * s.params.dt).powi(2) / lightest;
    match Part::names(3)[member] {
        "kinetic" => kinetic,
        "net_force" if s.model.method == Method::ContactDynamics => {
            s.part.iter().map(|part| part.contact_force).fold(0.0, f64::max)
        }
        "dissipation" => 2.0 * s.params.damping * kinetic,
        _ => 0.0,
    }
}

/// Lanes of each member of a record: a vector is one member. Plain arrays have one.
fn member_lanes(s: &State, array: &str, width: usize) -> Vec<std::ops::Range<usize>> {
    let names = s.column(array).names(s.model.dims());
    if names.is_empty() || names.starts_with(&["x", "y"]) {
        return std::iter::once(0..width).collect();
    }
    let vectors = ["x", "v", "point", "residue", "normal", "velocity"];
    let mut at = 0;
    names
        .iter()
        .map(|name| {
            let len = if vectors.contains(name) { s.model.dims() } else { 1 };
            at += len;
            at - len..at
        })
        .collect()
}

/// The grain a slot belongs to.
fn owner(s: &State, slot: usize) -> usize {
    s.slot_start[..s.sizes.bodies].partition_point(|begin| *begin as usize <= slot).saturating_sub(1)
}

/// Flags must agree; the drift is a number behind its bits.
fn counters(a: &[f64], b: &[f64]) -> (f64, f64) {
    const DRIFT: usize = 2;
    let flags = (0..a.len()).filter(|k| *k != DRIFT && a[*k] != b[*k]).count() as f64;
    let drift = |c: &[f64]| f64::from(f32::from_bits(c[DRIFT] as u32));
    let (x, y) = (drift(a), drift(b));
    let difference = if x == y { 0.0 } else { (x - y).abs() / x.max(y) };
    (flags.max(difference), difference)
}

/// Positions with their residues: the difference over the largest displacement of this step, which is what must not be
/// lost. (Either part alone may differ by a whole unit in the last place of the position.)
fn positions(twin: &State, device: &State, undecided: &[bool]) -> (f64, f64) {
    let way = twin.motion_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * twin.params.dt;
    // Members of clumps are put at the ends of arms, anew in every step, with 34 bits of the longest of these.
    let arm = twin.offset.iter().map(|arm| arm.0.length()).fold(0.0, f64::max);
    let largest = way.max(arm * 2f64.powi(-15)).max(twin.params.quantum / 64.0);
    let decided = (0..twin.sizes.bodies).filter(|i| !undecided.get(*i).is_some_and(|u| *u));
    let difference = |i: usize| {
        let rest = twin.residue_next[i].x - device.residue_next[i].x;
        ((twin.place_next[i].x - device.place_next[i].x) + rest).abs().max_element()
    };
    worst_and_rms(decided.map(difference), largest)
}

/// Rounding may make a round more or less.
fn rounds(twin: &State, device: &State) -> (f64, f64) {
    let (a, b) = (twin.rounds[0], device.rounds[0]);
    let different = a.most.abs_diff(b.most) > 1 || a.capped != b.capped;
    (f64::from(u8::from(different)), 0.0)
}

/// The same for the centres of clumps.
fn centers(twin: &State, device: &State) -> (f64, f64) {
    let largest = twin.clump_motion_next.iter().map(|m| m.v.abs().max_element()).fold(0.0, f64::max) * twin.params.dt;
    let difference = |c: usize| {
        let rest = twin.center_residue_next[c] - device.center_residue_next[c];
        ((twin.center_next[c] - device.center_next[c]) + rest).abs().max_element()
    };
    worst_and_rms((0..twin.sizes.clumps).map(difference), largest.max(twin.params.quantum / 64.0))
}

/// The same for their attitudes, over the largest turn of this step.
fn attitudes(twin: &State, device: &State) -> (f64, f64) {
    let largest = twin.clump_spin_next.iter().map(|w| w.0.abs().max_element()).fold(0.0, f64::max);
    let difference = |c: usize| {
        let rest = twin.attitude_residue_next[c].0 - device.attitude_residue_next[c].0;
        ((twin.attitude_next[c].0 - device.attitude_next[c].0) + rest).abs().max_element()
    };
    // At rest, some units in the last place of the residues are what their lengths are corrected by.
    worst_and_rms((0..twin.sizes.clumps).map(difference), (0.5 * largest * twin.params.dt).max(2f64.powi(-16)))
}

/// The largest difference and their root mean square, over a scale.
fn worst_and_rms(differences: impl Iterator<Item = f64>, scale: f64) -> (f64, f64) {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0_f64);
    for difference in differences {
        worst = if difference.is_nan() { f64::INFINITY } else { worst.max(difference) };
        squares += difference * difference;
        count += 1.0;
    }
    if worst == 0.0 { (0.0, 0.0) } else { (worst / scale, (squares / count).sqrt() / scale) }
}
