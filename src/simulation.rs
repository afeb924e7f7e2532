//! Simulation = scene + plan + engine + state: advances in chunks, replays a chunk that did not fit, and hands out
//! samples and states.

use crate::{
    engine::{Cpu, Engine, Gpu, gpu},
    error::{Error, Result},
    gpu::Device,
    laws::{
        dashpot::damping_ratio,
        precision::{quantised, quantum, residue_of},
        rotation::{inverse_inertia, spin_at_step},
    },
    measure::Sample,
    memory,
    model::{Model, Precision, Rotation},
    plan::{Plan, plan},
    scene::{Assembly, Dashpot, Grain, Surface},
    state::{Array, Motion, PARTS, Pair, Params, Place, Sizes, Spin, State, Wall},
    time_step,
};
use glam::{DVec3, UVec3};

/// Which engine to run on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EngineChoice {
    /// The best adapter, else the CPU.
    #[default]
    Auto,
    Gpu,
    Cpu,
}

/// How to run, as opposed to what.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    pub engine: EngineChoice,
    pub precision: Precision,
    /// Neighbour slots to start with; more are made when needed. None: a guess.
    pub slots: Option<usize>,
    /// Most steps between two looks at the device.
    pub longest_chunk: u32,
}

impl Default for Options {
    fn default() -> Options {
        Options { engine: EngineChoice::Auto, precision: Precision::Single, slots: None, longest_chunk: 100 }
    }
}

/// A running simulation.
pub struct Simulation {
    assembly: Assembly,
    plan: Plan,
    engine: Box<dyn Engine>,
    /// The host's mirror; only as fresh as the last read.
    state: State,
    /// One line on which engine was taken, and why.
    notice: String,
    dt_bound: f64,
    step: u64,
    chunk: u32,
    longest_chunk: u32,
    /// Neighbour slots that the next lists get, and the lengths of the current lists and of the spare ones.
    slots: usize,
    list_len: usize,
    spare_len: usize,
    replayed: u64,
    lost: u64,
}

/// Everything a scene implies before an engine is chosen: the state at time 0, its plan, and the time step's bound.
pub struct Setup {
    pub state: State,
    pub plan: Plan,
    pub dt_bound: f64,
}

impl Setup {
    /// Arrays, parameters and plan of a scene.
    ///
    /// # Errors
    /// [`Error::Scene`] if the time step is above its bound, [`Error::Device`] if the host's memory cannot hold it.
    pub fn new(assembly: &Assembly, options: &Options) -> Result<Setup> {
        let (dt, dt_bound) = time_step::choose(assembly)?;
        // The CPU engine has only f64.
        let precision = if options.engine == EngineChoice::Cpu { Precision::Double } else { options.precision };
        let model = Model::of(assembly, precision);
        let params = params(assembly, &model, dt);
        let bodies = assembly.grains.len();
        let cells = params.cells.as_u64vec3();
        let guess = bodies * if assembly.dimension == 2 { 5 } else { 10 };
        let sizes = Sizes {
            bodies,
            walls: assembly.walls.len(),
            materials: assembly.materials.len(),
            cells: (cells.x * cells.y * cells.z) as usize,
            slots: options.slots.unwrap_or(guess).max(1),
        };
        memory::check_host(bodies as u64 * memory::BYTES_PER_GRAIN)?;
        let mut state = State::new(model, sizes, params);
        fill(&mut state, assembly);
        if precision == Precision::Single {
            check_range(&state)?;
        }
        Ok(Setup { plan: plan(&model), state, dt_bound })
    }
}

/// Contact parameters as the kernels want them.
fn pair(pair: &crate::scene::Pair) -> Pair {
    Pair {
        stiffness: pair.normal_stiffness,
        tangential_stiffness: pair.tangential_stiffness,
        friction: pair.friction,
        dashpot: match pair.dashpot {
            Dashpot::None => 0.0,
            Dashpot::Restitution(e) => damping_ratio(e),
            Dashpot::MassScaled(eta) => eta,
        },
    }
}

/// Stands for "no bound" in both precisions; infinities are not safe on every device.
const UNBOUNDED: f64 = 3e38;

fn params(assembly: &Assembly, model: &Model, dt: f64) -> Params {
    let grains = &assembly.grains;
    let mean_radius = grains.iter().map(|g| g.radius).sum::<f64>() / grains.len() as f64;
    let largest = grains.iter().map(|g| g.radius).fold(0.0, f64::max);
    let margin = assembly.solver.margin * mean_radius;
    let mut p = Params {
        gravity: assembly.gravity,
        lower: DVec3::splat(-UNBOUNDED),
        upper: DVec3::splat(UNBOUNDED),
        dt,
        damping: assembly.solver.damping,
        margin,
        drift_limit: 0.5 * margin,
        pair: pair(&assembly.pairs[0]),
        cells: UVec3::ONE,
        bodies: grains.len() as u32,
        walls: assembly.walls.len() as u32,
        materials: assembly.materials.len() as u32,
        parts: PARTS as u32,
        ..Params::default()
    };
    let corners = domain_corners(assembly);
    p.quantum = quantum(corners.map(|x| x.abs().max_element()).fold(0.0, f64::max));
    p.inverse_quantum = 1.0 / p.quantum;
    let single = model.precision == Precision::Single;
    // A hair wider than the reach of the lists, so that rounding cannot hide a neighbour two cells away.
    let edge = 1.001 * (2.0 * largest + margin);
    let domain = &assembly.domain;
    for axis in 0..model.dims() {
        let positions = || grains.iter().map(|g| g.position[axis]);
        let (lower, upper) = (domain.lower[axis], domain.upper[axis]);
        if domain.periodic[axis] {
            p.period[axis] = upper - lower;
            p.inverse_period[axis] = 1.0 / p.period[axis];
            if single {
                let whole = quantised(&p, p.period)[axis];
                (p.period_rest[axis], p.period[axis]) = (p.period[axis] - whole, whole);
            }
            p.cell_origin[axis] = lower;
            p.cells[axis] = (p.period[axis] / edge).floor().clamp(1.0, 1e6) as u32;
            p.inverse_cell[axis] = f64::from(p.cells[axis]) / p.period[axis];
        } else {
            p.lower[axis] = lower.max(-UNBOUNDED);
            p.upper[axis] = upper.min(UNBOUNDED);
            p.cell_origin[axis] = positions().fold(f64::INFINITY, f64::min);
            let extent = positions().fold(f64::NEG_INFINITY, f64::max) - p.cell_origin[axis];
            p.cells[axis] = ((extent / edge).floor() + 1.0).clamp(1.0, 1e6) as u32;
            p.inverse_cell[axis] = 1.0 / edge;
        }
    }
    // Open axes wrap around, so fewer cells are always right; a sparse scene need not pay for its emptiness.
    let budget = (2 * grains.len() as u64).max(64);
    loop {
        let total: u64 = p.cells.to_array().iter().map(|c| u64::from(*c)).product();
        let open = (0..model.dims()).filter(|a| !domain.periodic[*a]).max_by_key(|a| p.cells[*a]);
        match open {
            Some(axis) if total > budget && p.cells[axis] > 3 => p.cells[axis] = p.cells[axis].div_ceil(2).max(3),
            _ => break,
        }
    }
    // A periodic axis must be divided exactly, so there emptiness is paid for with larger cells.
    loop {
        let total: u64 = p.cells.to_array().iter().map(|c| u64::from(*c)).product();
        let axis = (0..model.dims()).filter(|a| domain.periodic[*a]).max_by_key(|a| p.cells[*a]);
        match axis {
            Some(axis) if total > 4 * budget && p.cells[axis] > 3 => {
                p.cells[axis] = p.cells[axis].div_ceil(2).max(3);
                p.inverse_cell[axis] = f64::from(p.cells[axis]) / p.period[axis];
            }
            _ => break,
        }
    }
    p
}

/// Positions of grains and finite corners of the domain: how far coordinates go.
fn domain_corners(assembly: &Assembly) -> impl Iterator<Item = DVec3> {
    let finite = |x: DVec3| DVec3::select(x.is_finite_mask(), x, DVec3::ZERO);
    let corners = [assembly.domain.lower, assembly.domain.upper].map(finite);
    assembly.grains.iter().map(|g| g.position).chain(corners)
}

fn fill(state: &mut State, assembly: &Assembly) {
    let dimension = state.model.dimension;
    for (i, grain) in assembly.grains.iter().enumerate() {
        let density = assembly.materials[grain.material as usize].density;
        let mass = time_step::mass(dimension, density, grain.radius);
        state.place[i] = Place { x: grain.position, radius: grain.radius };
        if let Some(residue) = state.residue.get_mut(i) {
            let whole = quantised(&state.params, grain.position);
            (state.place[i].x, *residue) = (whole, grain.position - whole);
        }
        state.motion[i] = Motion { v: grain.velocity, inverse_mass: if grain.fixed { 0.0 } else { 1.0 / mass } };
    }
    if state.model.rotation == Rotation::Sphere {
        state.spin = assembly.grains.iter().map(|g| Spin(g.spin)).collect();
    }
    for (wall, given) in state.wall.iter_mut().zip(&assembly.walls) {
        let (point, normal, radius) = match given.surface {
            Surface::Plane { point, normal } => (point, normal, 0.0),
            Surface::Cylinder { center, radius } => (center, DVec3::ZERO, radius),
        };
        *wall = Wall { point, normal, velocity: given.velocity, radius, spin: given.spin };
    }
    if !state.material.is_empty() {
        let materials = assembly.grains.iter().map(|g| g.material).chain(assembly.walls.iter().map(|w| w.material));
        state.material = materials.collect();
        state.pair = assembly.pairs.iter().map(pair).collect();
    }
}

/// What leaves the range of f32 must not get to a device that computes in it.
///
/// # Errors
/// [`Error::Scene`] with the grain and the number.
fn check_range(state: &State) -> Result<()> {
    let fits = |x: f64| x == 0.0 || (f64::from(f32::MIN_POSITIVE)..1e37).contains(&x.abs());
    for (i, (place, motion)) in state.place.iter().zip(&state.motion).enumerate() {
        let inertia = inverse_inertia(state, place, motion.inverse_mass);
        let numbers = [("inverse mass", motion.inverse_mass), ("inverse moment of inertia", inertia)];
        if let Some((what, number)) = numbers.into_iter().find(|(_, x)| !fits(*x)) {
            return Err(Error::Scene(format!(
                "grain {i}: its {what}, {number:e} in SI units, is beyond single precision; use --precision double or \
                 --engine cpu"
            )));
        }
    }
    Ok(())
}

/// Set-up and engine for a choice, and one line that says which engine and why.
fn build(assembly: &Assembly, options: &Options) -> Result<(Setup, Box<dyn Engine>, String)> {
    let double = options.precision == Precision::Double;
    let on_cpu = |why: &str| -> Result<(Setup, Box<dyn Engine>, String)> {
        let setup = Setup::new(assembly, &Options { engine: EngineChoice::Cpu, ..*options })?;
        let engine = Cpu::new(setup.state.clone());
        let notice = format!("engine cpu (f64, {}): {why}", engine.adapter());
        Ok((setup, Box::new(engine), notice))
    };
    let on_gpu = || -> Result<(Setup, Box<dyn Engine>, String)> {
        let device = Device::open(double)?;
        let setup = Setup::new(assembly, options)?;
        let gpu = Gpu::new(device, &setup.plan, &setup.state)?;
        let real = if double { "f64" } else { "f32" };
        let why = if options.engine == EngineChoice::Gpu { "asked for" } else { "best adapter found" };
        let notice = format!("engine gpu ({real}, {}): {why}", gpu.adapter());
        Ok((setup, Box::new(gpu), notice))
    };
    match options.engine {
        EngineChoice::Cpu => on_cpu("asked for"),
        EngineChoice::Gpu => on_gpu(),
        EngineChoice::Auto => match on_gpu() {
            Err(Error::Device(why)) => on_cpu(&why),
            result => result,
        },
    }
}

/// Steps in which the fastest wall uses up its half of the margin.
///
/// # Errors
/// [`Error::Scene`] if that is less than one step.
fn wall_limit(assembly: &Assembly, p: &Params) -> Result<u32> {
    let speed = |w: &crate::scene::Wall| w.velocity.length();
    let Some(wall) = assembly.walls.iter().max_by(|a, b| speed(a).total_cmp(&speed(b))) else { return Ok(u32::MAX) };
    let steps = p.drift_limit / (speed(wall) * p.dt);
    if steps < 1.0 {
        return Err(Error::Scene(format!(
            "wall {} moves {:e} m in a step of {:e} s; at most {:e} m can be followed: use a smaller solver.dt or a larger \
             solver.margin",
            wall.name,
            speed(wall) * p.dt,
            p.dt,
            p.drift_limit
        )));
    }
    Ok(steps.min(1e6) as u32)
}

impl Simulation {
    /// Build a scene and bring it to time 0.
    ///
    /// # Errors
    /// [`Error::Scene`] for a time step above the bound, [`Error::Device`] if there is no adapter or not enough memory.
    pub fn new(assembly: Assembly, options: Options) -> Result<Simulation> {
        let (Setup { state, plan, dt_bound }, engine, notice) = build(&assembly, &options)?;
        let longest_chunk = options.longest_chunk.max(1).min(wall_limit(&assembly, &state.params)?);
        let slots = state.sizes.slots;
        let mut simulation = Simulation {
            assembly,
            plan,
            engine,
            state,
            notice,
            dt_bound,
            step: 0,
            chunk: longest_chunk.min(8),
            longest_chunk,
            slots,
            list_len: slots,
            spare_len: slots,
            replayed: 0,
            lost: 0,
        };
        simulation.start()?;
        Ok(simulation)
    }

    /// Lists, forces at time 0 with springs at rest, and velocities half a step back.
    fn start(&mut self) -> Result<()> {
        let params = self.state.params;
        loop {
            self.rebuild()?;
            let counters = self.engine.counters()?;
            if counters.slots_needed as usize > self.list_len {
                self.grow(counters.slots_needed);
                self.restore()?;
                continue;
            }
            if counters.bad_body > 0 {
                return Err(self.gone(params.bodies - counters.bad_body, self.step)?);
            }
            break;
        }
        self.engine.execute(&Params { dt: 0.0, ..params }, &self.plan.start, 1)?;
        self.engine.execute(&params, &self.plan.kick, 1)
    }

    /// New lists, in the arrays that the lists of the chunk before last occupy: those may be made longer first.
    fn rebuild(&mut self) -> Result<()> {
        let frictional = !self.state.spring.is_empty();
        let (neighbour, spring) =
            if frictional { ("neighbour_before", "spring_before") } else { ("neighbour", "spring") };
        let spare = if frictional { &mut self.spare_len } else { &mut self.list_len };
        if *spare != self.slots {
            self.engine.resize(neighbour, self.slots)?;
            if frictional {
                self.engine.resize(spring, self.slots)?;
            }
            *spare = self.slots;
        }
        self.engine.execute(&self.state.params, &self.plan.rebuild, 1)?;
        self.exchange_lengths();
        Ok(())
    }

    /// The state of before the last `rebuild`.
    fn restore(&mut self) -> Result<()> {
        self.engine.execute(&self.state.params, &self.plan.restore, 1)?;
        self.exchange_lengths();
        Ok(())
    }

    /// Frictional lists change places with the spare ones in every rebuild and restore.
    fn exchange_lengths(&mut self) {
        if !self.state.spring.is_empty() {
            std::mem::swap(&mut self.list_len, &mut self.spare_len);
        }
    }

    fn undo(&mut self) -> Result<()> {
        self.replayed += 1;
        self.restore()
    }

    fn grow(&mut self, needed: u32) {
        self.slots = needed as usize + needed as usize / 4;
    }

    /// Advance by this many steps, in chunks.
    ///
    /// # Errors
    /// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
    pub fn advance(&mut self, steps: u64) -> Result<()> {
        let end = self.step + steps;
        while self.step < end {
            self.try_chunk((end - self.step).min(u64::from(self.chunk)) as u32)?;
        }
        Ok(())
    }

    /// One chunk of at most `steps` (at least 1), so that progress can be shown and a run interrupted; returns the
    /// steps done.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance_chunk(&mut self, steps: u64) -> Result<u64> {
        let before = self.step;
        while self.step == before {
            self.try_chunk(steps.clamp(1, u64::from(self.chunk)) as u32)?;
        }
        Ok(self.step - before)
    }

    fn try_chunk(&mut self, steps: u32) -> Result<()> {
        let params = self.state.params;
        self.rebuild()?;
        self.engine.execute(&params, &self.plan.step, steps)?;
        self.engine.execute(&params, &self.plan.close, 1)?;
        let counters = self.engine.counters()?;
        let drift = f64::from(f32::from_bits(counters.drift)).sqrt();
        if counters.slots_needed as usize > self.list_len {
            self.grow(counters.slots_needed);
            return self.undo();
        }
        if counters.bad_body > 0 || counters.broken > 0 {
            if steps == 1 {
                let reason = if counters.bad_body > 0 {
                    self.gone(params.bodies - counters.bad_body, self.step + 1)
                } else {
                    self.too_fast()
                }?;
                self.undo()?;
                return Err(reason);
            }
            self.undo()?;
            self.chunk = steps / 2;
            return Ok(());
        }
        self.lost += u64::from(counters.lost);
        self.step += u64::from(steps);
        // Aim at 70 % of the margin; grains that speed up cost a replay, lists made too often cost time.
        // A chunk cut short by a pause of the run tells nothing about longer ones, unless its grains were fast.
        let aim = f64::from(steps) * (0.7 / drift.max(0.01)).clamp(0.5, 2.0);
        if steps == self.chunk || aim < f64::from(self.chunk) && drift > 0.7 {
            self.chunk = (aim as u32).clamp(1, self.longest_chunk);
        }
        Ok(())
    }

    fn stopped(&self, step: u64, reason: String) -> Error {
        Error::Run { step, time: step as f64 * self.state.params.dt, reason }
    }

    fn gone(&mut self, id: u32, step: u64) -> Result<Error> {
        self.engine.read(&["place"], &mut self.state)?;
        let x = self.state.place[id as usize].x;
        let p = &self.state.params;
        let reason = if !x.is_finite() {
            format!("grain {id} has no position any more (not a number)")
        } else if crate::laws::dimension::outside(x, p.lower, p.upper) {
            format!("grain {id} has left the domain at {x} m")
        } else {
            format!("the centre of grain {id} is beyond a wall at {x} m")
        };
        Ok(self.stopped(step, format!("{reason}; is the time step ({:e} s) too large?", p.dt)))
    }

    fn too_fast(&mut self) -> Result<Error> {
        self.engine.read(&["place", "place_before"], &mut self.state)?;
        let s = &self.state;
        let moved = |i: usize| crate::laws::boundary::separation(s, s.place_before[i].x, s.place[i].x).length();
        let fastest = (0..s.sizes.bodies).max_by(|a, b| moved(*a).total_cmp(&moved(*b))).unwrap_or(0);
        let reason = format!(
            "grain {fastest} moves {:e} m in one step, {:.2} of its radius; at most {:e} m can be followed safely: use a \
             smaller time step, or a larger solver.margin",
            moved(fastest),
            moved(fastest) / s.place[fastest].radius,
            s.params.drift_limit,
        );
        Ok(self.stopped(self.step + 1, reason))
    }

    /// Sums over the grains now.
    pub fn sample(&mut self) -> Result<Sample> {
        let params = self.state.params;
        self.engine.execute(&params, &self.plan.sample, 1)?;
        self.engine.read(&["part"], &mut self.state)?;
        let free = self.assembly.grains.iter().filter(|g| !g.fixed).count();
        Ok(Sample::new(self.step, self.time(), free, &self.state.part))
    }

    /// All grains now, in input order, with velocities and spins brought to the time of the positions.
    pub fn grains(&mut self) -> Result<Vec<Grain>> {
        let rotating = self.state.model.rotation == Rotation::Sphere;
        let arrays = ["place", "residue", "motion", "force", "spin", "torque"];
        let present = arrays.into_iter().filter(|a| (Array::named(a).needed)(&self.state.model));
        self.engine.read(&present.collect::<Vec<_>>(), &mut self.state)?;
        let s = &self.state;
        let p = &s.params;
        let half = 0.5 * p.dt;
        let at_step = |(i, given): (usize, &Grain)| {
            let Motion { v, inverse_mass } = s.motion[i];
            let free = inverse_mass != 0.0;
            let acceleration = inverse_mass * s.force[i] + p.gravity;
            let spin = if rotating {
                spin_at_step(s, s.spin[i].0, s.torque[i].0, &s.place[i], inverse_mass)
            } else {
                given.spin
            };
            Grain {
                position: s.place[i].x + residue_of(s, i),
                velocity: if free { (v + half * acceleration) / (1.0 + half * p.damping) } else { v },
                spin,
                ..*given
            }
        };
        Ok(self.assembly.grains.iter().enumerate().map(at_step).collect())
    }

    /// Contact force (N) and its moment about the centre (N m) on every grain now, in input order; walls and dashpots
    /// included, weight and global damping not.
    pub fn forces(&mut self) -> Result<Vec<(DVec3, DVec3)>> {
        let present = ["force", "torque"].into_iter().filter(|a| (Array::named(a).needed)(&self.state.model));
        self.engine.read(&present.collect::<Vec<_>>(), &mut self.state)?;
        let moment = |i: usize| self.state.torque.get(i).map_or(DVec3::ZERO, |t| t.0);
        Ok(self.state.force.iter().enumerate().map(|(i, force)| (*force, moment(i))).collect())
    }

    /// Walls now.
    pub fn walls(&mut self) -> Result<Vec<crate::scene::Wall>> {
        let mut walls = self.assembly.walls.clone();
        if self.state.model.moving_walls {
            self.engine.read(&["wall"], &mut self.state)?;
            for (wall, now) in walls.iter_mut().zip(&self.state.wall) {
                match &mut wall.surface {
                    Surface::Plane { point, .. } => *point = now.point,
                    Surface::Cylinder { center, .. } => *center = now.point,
                }
            }
        }
        Ok(walls)
    }

    /// The host's copy of these arrays, read now.
    pub fn read(&mut self, arrays: &[&'static str]) -> Result<&State> {
        self.engine.read(arrays, &mut self.state)?;
        Ok(&self.state)
    }

    /// Bytes per grain of all arrays as they are now.
    pub fn bytes_per_particle(&self) -> Result<f64> {
        let s = &self.state;
        let layouts = gpu::layouts(&s.model, &self.plan)?;
        let sizes = Sizes { slots: self.list_len.max(self.spare_len), ..s.sizes };
        let total: u64 = gpu::bytes(&s.model, &layouts, &sizes).map(|(_, b)| b).sum();
        Ok(total as f64 / s.sizes.bodies as f64)
    }

    pub fn assembly(&self) -> &Assembly {
        &self.assembly
    }
    pub fn model(&self) -> &Model {
        &self.state.model
    }
    pub fn engine(&self) -> &dyn Engine {
        self.engine.as_ref()
    }
    /// One line: which engine was taken, and why.
    pub fn notice(&self) -> &str {
        &self.notice
    }
    /// s
    pub fn dt(&self) -> f64 {
        self.state.params.dt
    }
    /// s
    pub fn dt_bound(&self) -> f64 {
        self.dt_bound
    }
    pub fn step(&self) -> u64 {
        self.step
    }
    /// s
    pub fn time(&self) -> f64 {
        self.step as f64 * self.dt()
    }
    /// Chunks that were discarded and done again.
    pub fn replayed_chunks(&self) -> u64 {
        self.replayed
    }
    /// Contacts whose history got lost when lists were made anew: 0, or a defect.
    pub fn lost_contacts(&self) -> u64 {
        self.lost
    }
}
