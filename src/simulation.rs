//! Simulation = scene + plan + engine + state: advances in chunks, replays a chunk that did not fit, and hands out
//! samples and states.

mod columns;
mod host;
pub mod profile;
pub mod rigid;
mod setup;

pub use columns::Columns;
pub use setup::Setup;

use crate::{
    body::grains,
    engine::{Cpu, Engine, Gpu, gpu},
    error::{Error, Result},
    gpu::{Arrays, Device},
    measure::{Sample, masses},
    model::{Grains, Model, Precision, Rotation},
    plan::{Op, Plan},
    scene::{Assembly, Clump, Grain, Method, Surface},
    space::precision::position_low_of,
    state::{ARRAYS, Array, Counters, Length, Params, RotationIterations, Sizes, State},
};
use glam::{DQuat, DVec3};
use rigid::{Look, Solved};

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
    /// Neighbour slots there are at least; more are made when needed. None: as many as are needed.
    pub entries: Option<usize>,
    /// Most steps that neighbour lists may serve.
    pub longest_chunk: u32,
    /// What arrays are on a device.
    pub arrays: Arrays,
}

impl Default for Options {
    fn default() -> Options {
        Options {
            engine: EngineChoice::Auto,
            precision: Precision::Single,
            entries: None,
            longest_chunk: 200,
            arrays: Arrays::Auto,
        }
    }
}

/// Steps that lists should live: long enough that making them does not matter, short enough that they need not reach far.
const LIFE: f64 = 50.0;
/// The part of the way that grains may go which a chunk is planned to use; it ends early where that was too bold.
const BOLDNESS: f64 = 0.8;
/// The shortest reach of the lists beyond contact, in mean radii.
const LEAST_MARGIN: f64 = 0.02;

/// Devices round short buffers up, and kernels ask how long they are.
const LEAST_LENGTH: usize = 16;

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
    longest_chunk: u32,
    /// The margin that the scene allows, m; lists are made with less where grains are slow.
    widest_margin: f64,
    /// Way of the fastest grain per step in the last chunk, and of the fastest wall, m.
    pace: f64,
    wall_pace: f64,
    /// Neighbour slots that there are, and that the next lists get.
    list_len: usize,
    next_len: usize,
    least_slots: usize,
    history_len: usize,
    /// Springs at the end of the last chunk: what the history has to hold.
    springs: u32,
    /// Steps that the lists to be made are for, that the present ones have left, and that they have done.
    planned: u32,
    life: u32,
    age: u32,
    /// Whether grains may have moved out of the reach of the lists.
    spent: bool,
    replayed: u64,
    lost: u64,
    /// Contact dynamics: passes that a step may take, else 0; and how they have gone.
    most_passes: u32,
    solved: Solved,
    looks: Vec<Look>,
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
        let device = Device::open(double, options.arrays)?;
        let setup = Setup::new(assembly, options)?;
        let gpu = Gpu::new(device, &setup.plan, &setup.state)?;
        let real = if double { "f64" } else { "f32" };
        let why = if options.engine == EngineChoice::Gpu { "asked for" } else { "best adapter found" };
        let notice = format!("engine gpu ({real}, {}): {why}", gpu.adapter());
        Ok((setup, Box::new(gpu), notice))
    };
    let of_host = match assembly.solver.method {
        Method::ContactDynamics(r) if !host::on_engine(r.solver) => Some(r.solver),
        _ => None,
    };
    if let Some(solver) = of_host {
        return match options.engine {
            EngineChoice::Gpu => {
                Err(Error::Scene(format!("solver.relaxation = \"{}\" runs on the cpu engine only", solver.label())))
            }
            _ => on_cpu(&format!("{} runs there", solver.label())),
        };
    }
    match options.engine {
        EngineChoice::Cpu => on_cpu("asked for"),
        EngineChoice::Gpu => on_gpu(),
        EngineChoice::Auto => match on_gpu() {
            Err(Error::Device(why)) => on_cpu(&why),
            result => result,
        },
    }
}

/// A length for this many entries and a few more.
fn with_room(needed: u32) -> usize {
    needed as usize + needed as usize / 32 + LEAST_LENGTH
}

fn resize_lists(engine: &mut dyn Engine, state: &State, len: usize) -> Result<usize> {
    for array in ARRAYS.iter().filter(|a| a.length == Length::Entries && (a.needed)(&state.model)) {
        engine.resize(array.name, len)?;
    }
    Ok(len)
}

/// Way of the fastest wall per step, m.
///
/// # Errors
/// [`Error::Scene`] if that is more than lists can follow.
fn wall_pace(assembly: &Assembly, p: &Params) -> Result<f64> {
    let speed = |w: &crate::scene::Wall| w.velocity.length();
    let Some(wall) = assembly.walls.iter().max_by(|a, b| speed(a).total_cmp(&speed(b))) else { return Ok(0.0) };
    let pace = speed(wall) * p.dt;
    if pace > p.step_limit {
        return Err(Error::Scene(format!(
            "wall {} moves {pace:e} m in a step of {:e} s; at most {:e} m can be followed: use a smaller solver.dt or a larger \
             solver.margin",
            wall.name, p.dt, p.step_limit
        )));
    }
    Ok(pace)
}

impl Simulation {
    /// Build a scene and bring it to time 0.
    ///
    /// # Errors
    /// [`Error::Scene`] for what [`Assembly::validate`] refuses and for a time step above the bound, [`Error::Device`] if there is
    /// no adapter or not enough memory.
    pub fn new(mut assembly: Assembly, options: Options) -> Result<Simulation> {
        assembly.validate()?;
        assembly.fold_ends();
        let (Setup { state, plan, dt_bound }, engine, notice) = build(&assembly, &options)?;
        let slots = state.sizes.entries;
        let most_passes = match assembly.solver.method {
            Method::DiscreteElements => 0,
            Method::ContactDynamics(relaxation) => relaxation.max_iterations,
        };
        let mut simulation = Simulation {
            wall_pace: wall_pace(&assembly, &state.params)?,
            pace: 0.0,
            widest_margin: state.params.margin,
            longest_chunk: options.longest_chunk.max(1),
            assembly,
            plan,
            engine,
            state,
            notice,
            dt_bound,
            step: 0,
            list_len: slots,
            next_len: slots,
            least_slots: options.entries.unwrap_or(0),
            history_len: LEAST_LENGTH,
            springs: 0,
            planned: 1,
            life: 0,
            age: 0,
            spent: false,
            replayed: 0,
            lost: 0,
            most_passes,
            solved: Solved::default(),
            looks: Vec::new(),
        };
        simulation.start()?;
        Ok(simulation)
    }

    /// Back to time 0, without impulses or springs, on an engine that has compiled its kernels already.
    ///
    /// # Errors
    /// As [`Simulation::new`].
    pub fn rewind(&mut self) -> Result<()> {
        setup::fill(&mut self.state, &self.assembly);
        let bodies = ["position", "position_low", "velocity", "spin", "id", "wall"];
        let clumps = [
            "center",
            "center_low",
            "orientation",
            "orientation_low",
            "clump_velocity",
            "clump_spin",
            "spin_increment",
            "rotation_iterations",
        ];
        let present: Vec<_> =
            bodies.into_iter().chain(clumps).filter(|a| (Array::named(a).needed)(&self.state.model)).collect();
        self.engine.write(&present, &self.state)?;
        // Lists without entries leave no history.
        self.engine.execute(&self.state.params, &[(&[Op::Clear("list_start")], 1)])?;
        let p = &mut self.state.params;
        (p.margin, p.displacement_limit) = (self.widest_margin, 0.5 * self.widest_margin);
        (self.step, self.springs, self.planned, self.life, self.spent) = (0, 0, 1, 0, false);
        (self.solved, self.replayed, self.lost) = (Solved::default(), 0, 0);
        self.start()
    }

    /// Lists, and velocities half a step back.
    fn start(&mut self) -> Result<()> {
        let speed = self.assembly.grains.iter().map(|g| g.velocity.length()).fold(0.0, f64::max);
        // Nothing is known yet of what forces will do to the speeds.
        self.pace = (speed * self.state.params.dt).max(self.widest_margin / LIFE);
        let counters = self.run(0)?;
        if counters.lost_body > 0 {
            return Err(self.gone(counters.lost_body, self.step)?);
        }
        self.engine.execute(&self.params(), &[(&self.plan.kick, 1)])
    }

    /// The parameters of the next step: at time 0 springs have not been stretched yet.
    fn params(&self) -> Params {
        let p = &self.state.params;
        Params { history_dt: if self.step == 0 { 0.0 } else { p.dt }, ..*p }
    }

    /// Let lists reach as far as they must to live a while at the present pace, and say how many steps that is.
    fn set_margin(&mut self) {
        let pace = self.pace.max(self.wall_pace).max(f64::MIN_POSITIVE);
        let p = &mut self.state.params;
        let least = LEAST_MARGIN * self.widest_margin / self.assembly.solver.margin;
        p.margin = (2.0 * pace * LIFE / BOLDNESS).clamp(least.min(self.widest_margin), self.widest_margin);
        p.displacement_limit = 0.5 * p.margin;
        let walls = p.displacement_limit / self.wall_pace;
        let steps = (BOLDNESS * p.displacement_limit / pace).min(walls).min(f64::from(self.longest_chunk));
        self.planned = (steps as u32).max(1);
    }

    /// New lists if it is time, and then this many steps, or fewer if a grain comes to the end of the lists' reach or is lost.
    fn run(&mut self, steps: u32) -> Result<Counters> {
        if self.springs as usize > self.history_len {
            self.history_len = with_room(self.springs);
            for array in ARRAYS.iter().filter(|a| a.length == Length::History && (a.needed)(&self.state.model)) {
                self.engine.resize(array.name, self.history_len)?;
            }
        }
        let params = self.params();
        let plan = &self.plan;
        let (begin, sort, list) = ((&plan.begin[..], 1), (&plan.sort[..], 1), (&plan.list[..], 1));
        let (step, survey) = ((&plan.step[..], steps), (&plan.survey[..], 1));
        let anew = self.life == 0;
        if !anew {
            self.engine.execute(&params, &[begin, step, survey])?;
        } else if self.next_len == self.list_len {
            self.engine.execute(&params, &[begin, sort, list, step, survey])?;
        } else {
            self.engine.execute(&params, &[sort])?;
            self.list_len = resize_lists(self.engine.as_mut(), &self.state, self.next_len)?;
            self.engine.execute(&params, &[begin, list, step, survey])?;
        }
        let mut counters = self.engine.counters()?;
        if counters.entries_needed as usize > self.list_len {
            self.replayed += 1;
            // Lists that do not fit are not walked: nothing has happened but the exchanges of buffers.
            self.engine.execute(&params, &[(&plan.swaps, steps)])?;
            self.list_len = resize_lists(self.engine.as_mut(), &self.state, with_room(counters.entries_needed))?;
            self.engine.execute(&params, &[begin, list, step, survey])?;
            counters = self.engine.counters()?;
        }
        self.engine.execute(&params, &[(&plan.swaps, steps.saturating_sub(counters.steps_done))])?;
        if anew {
            let needed = counters.entries_needed as usize;
            let step_divisor = with_room(counters.entries_needed).max(self.least_slots);
            self.next_len = if 8 * needed < 7 * self.list_len { step_divisor } else { self.list_len };
            self.lost +=
                u64::from(self.springs.saturating_sub(counters.restored_contacts)) + u64::from(counters.unlisted);
            (self.life, self.age) = (self.planned, 0);
        }
        self.note_drift(&counters);
        self.life = if self.spent { 0 } else { self.life - counters.steps_done };
        self.replayed += u64::from(counters.steps_done < steps);
        Ok(counters)
    }

    /// What the survey has found.
    fn note_drift(&mut self, counters: &Counters) {
        self.springs = counters.active_contacts;
        self.age += counters.steps_done;
        let drift = f64::from(f32::from_bits(counters.max_displacement));
        self.spent = !(drift <= 1.0);
        if self.age > 0 {
            self.pace = drift * self.state.params.displacement_limit / f64::from(self.age);
        }
    }

    /// Advance by this many steps, in chunks.
    ///
    /// # Errors
    /// [`Error::Run`] if a grain is lost or moves too fast; the state is then the last good one.
    pub fn advance(&mut self, steps: u64) -> Result<()> {
        let end = self.step + steps;
        while self.step < end {
            self.advance_chunk(end - self.step)?;
        }
        Ok(())
    }

    /// One chunk of at most `steps` (at least 1), so that progress can be shown and a run interrupted; returns the
    /// steps done.
    ///
    /// # Errors
    /// As [`Simulation::advance`].
    pub fn advance_chunk(&mut self, steps: u64) -> Result<u64> {
        if self.most_passes > 0 {
            return self.advance_rigid().map(|()| 1);
        }
        if self.life == 0 {
            self.set_margin();
        }
        let chunk = if self.life == 0 { self.planned } else { self.life };
        let steps = if self.step == 0 { 1 } else { steps.clamp(1, u64::from(chunk)) as u32 };
        let counters = self.run(steps)?;
        if counters.lost_body > 0 {
            let reason = self.gone(counters.lost_body, self.step + u64::from(counters.steps_done))?;
            if counters.steps_done > 0 {
                // The state before the step that lost the grain is where the step after it would have been written.
                self.engine.execute(&self.state.params, &[(&self.plan.swaps, 1)])?;
                self.step += u64::from(counters.steps_done - 1);
                (self.spent, self.life) = (true, 0);
            }
            return Err(reason);
        }
        if counters.steps_done == 0 {
            // A defect, which must not turn into a loop without end.
            return Err(Error::Device(format!("{} did none of {steps} steps and gave no reason", self.engine.name())));
        }
        self.step += u64::from(counters.steps_done);
        Ok(u64::from(counters.steps_done))
    }

    /// Lists that reach, for a look at the contacts between two chunks.
    fn refresh(&mut self) -> Result<()> {
        if self.spent {
            self.set_margin();
            self.run(0)?;
        }
        Ok(())
    }

    fn stopped(&self, step: u64, reason: String) -> Error {
        Error::Run { step, time: step as f64 * self.state.params.dt, reason }
    }

    /// Why the run cannot go on, from the device's mark of the grain.
    fn gone(&mut self, mark: u32, step: u64) -> Result<Error> {
        self.engine.read(&["position", "velocity", "id"], &mut self.state)?;
        let p = &self.state.params;
        let lost = p.bodies - mark;
        let at = self.state.id.iter().position(|id| *id == lost).unwrap_or(0);
        let x = self.state.position[at].x;
        let stride = self.state.velocity[at].v.length() * p.dt;
        let reason = if !x.is_finite() {
            format!("grain {lost} has no position any more (not a number)")
        } else if stride > p.step_limit {
            format!(
                "grain {lost} moves {stride:e} m in one step, {:.2} of its radius; at most {:e} m can be followed safely (half of \
                 solver.margin, or of the smallest radius)",
                stride / self.state.position[at].radius,
                p.step_limit
            )
        } else if crate::space::dimension::outside(x, p.lower, p.upper) {
            format!("grain {lost} has left the domain at {x} m")
        } else {
            format!("the centre of grain {lost} is beyond a wall at {x} m")
        };
        Ok(self.stopped(step, format!("{reason}; is the time step ({:e} s) too large?", p.dt)))
    }

    /// Sums over the grains now.
    pub fn sample(&mut self) -> Result<Sample> {
        self.refresh()?;
        self.engine.execute(&self.params(), &[(&self.plan.sample, 1)])?;
        self.engine.read(&["partial_sums"], &mut self.state)?;
        let free = match &self.assembly.clumps[..] {
            [] => self.assembly.grains.iter().filter(|g| !g.fixed).count(),
            clumps => clumps.iter().filter(|c| !c.fixed).count(),
        };
        let sample = Sample::new(self.step, self.time(), free, &self.state.partial_sums);
        let Some(solved) = self.solved().copied() else { return Ok(sample) };
        let p = &self.state.params;
        let masses = masses(&self.assembly).into_iter().zip(&self.assembly.grains).filter(|(_, g)| !g.fixed);
        let mass: f64 = masses.map(|(m, _)| m).sum();
        let pull = p.gravity.length().max(sample.contact_force * free as f64 / f64::max(mass, f64::MIN_POSITIVE));
        Ok(Sample {
            iterations: Some(solved.last_iterations),
            residual: Some(solved.last_residual),
            coulomb_excess: Some(solved.last_excess),
            step_energy: 0.5 * mass * (pull * p.dt).powi(2),
            ..sample
        })
    }

    /// All grains now, in input order, with velocities and spins brought to the time of the positions.
    pub fn grains(&mut self) -> Result<Vec<Grain>> {
        self.refresh()?;
        self.engine.execute(&self.params(), &[(&self.plan.synchronise, 1)])?;
        let arrays = ["position", "position_low", "velocity_next", "spin_next", "id"];
        let present = arrays.into_iter().filter(|a| (Array::named(a).needed)(&self.state.model));
        self.engine.read(&present.collect::<Vec<_>>(), &mut self.state)?;
        let s = &self.state;
        let mut grains = self.assembly.grains.clone();
        for i in 0..s.sizes.bodies {
            let grain = &mut grains[s.id[i] as usize];
            grain.position = s.position[i].x + position_low_of(s, i).x;
            grain.velocity = s.velocity_next[i].v;
            grain.spin = s.spin_next.get(i).map_or(grain.spin, |spin| spin.0);
        }
        Ok(grains)
    }

    /// The same as columns.
    ///
    /// # Errors
    /// As [`Simulation::grains`].
    pub fn columns(&mut self) -> Result<Columns> {
        Ok(Columns::from(&self.grains()?[..]))
    }

    /// All clumps now, in input order, with velocities and spins brought to the time of the positions; empty in a scene without.
    pub fn clumps(&mut self) -> Result<Vec<Clump>> {
        if self.state.model.grains == Grains::Spheres {
            return Ok(Vec::new());
        }
        self.refresh()?;
        self.engine.execute(&self.params(), &[(&self.plan.synchronise, 1)])?;
        let arrays =
            ["center", "center_low", "orientation", "orientation_low", "clump_velocity_next", "clump_spin_next"];
        let present = arrays.into_iter().filter(|a| (Array::named(a).needed)(&self.state.model));
        self.engine.read(&present.collect::<Vec<_>>(), &mut self.state)?;
        let mut clumps = self.assembly.clumps.clone();
        for (c, clump) in clumps.iter_mut().enumerate() {
            let (s, here) = (&self.state, grains::clump(&self.state, c));
            let principal = DQuat::from_vec4(here.orientation).normalize();
            clump.position = here.center.x + here.center.low;
            clump.velocity = s.clump_velocity_next[c].v;
            clump.spin = grains::global_spin(s, here.inverse_moments, here.orientation, s.clump_spin_next[c].0);
            clump.orientation = principal * self.assembly.shapes[clump.shape as usize].frame.inverse();
        }
        Ok(clumps)
    }

    /// How hard the iterations for the rotation of clumps had to work so far, the predictor-corrector (2.24)-(2.31) or in contact dynamics
    /// that of the gyroscopic term: most rounds for a clump, and how often one ended before it met the tolerance. None in a scene without clumps.
    pub fn rotation_rounds(&mut self) -> Result<Option<(u32, u32)>> {
        if self.state.model.grains == Grains::Spheres {
            return Ok(None);
        }
        self.engine.read(&["rotation_iterations"], &mut self.state)?;
        let RotationIterations { most, capped } = self.state.rotation_iterations[0];
        Ok(Some((most, capped)))
    }

    /// Contact force (N) and its moment about the centre (N m) on every grain now, in input order; walls and dashpots
    /// included, weight and global damping not.
    pub fn forces(&mut self) -> Result<Vec<(DVec3, DVec3)>> {
        self.refresh()?;
        let bodies = self.state.sizes.bodies;
        let rotating = self.state.model.rotation == Rotation::Sphere;
        let arrays: &[&'static str] = if rotating { &["force", "torque"] } else { &["force"] };
        arrays.iter().try_for_each(|array| self.engine.resize(array, bodies))?;
        self.engine.execute(&self.params(), &[(&self.plan.forces, 1)])?;
        self.engine.read(&[arrays, &["id"]].concat(), &mut self.state)?;
        arrays.iter().try_for_each(|array| self.engine.resize(array, 1))?;
        let s = &self.state;
        let mut forces = vec![(DVec3::ZERO, DVec3::ZERO); bodies];
        for i in 0..bodies {
            forces[s.id[i] as usize] = (s.force[i], s.torque.get(i).map_or(DVec3::ZERO, |t| t.0));
        }
        Ok(forces)
    }

    /// Walls now.
    pub fn walls(&mut self) -> Result<Vec<crate::scene::Wall>> {
        let mut walls = self.assembly.walls.clone();
        if self.state.model.moving_walls {
            self.engine.read(&["wall"], &mut self.state)?;
            for (wall, now) in walls.iter_mut().zip(&self.state.wall) {
                match &mut wall.surface {
                    Surface::Plane { point, .. } => *point = now.point + now.low,
                    Surface::Cylinder { center, .. } => *center = now.point + now.low,
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
        let sizes = Sizes { entries: self.list_len, history: self.history_len, ..s.sizes };
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
    /// Chunks that were done again with longer lists, or ended early because a grain came to the end of the lists' reach.
    pub fn replayed_chunks(&self) -> u64 {
        self.replayed
    }
    /// Contacts whose history got lost when lists were made anew: 0, or a defect.
    pub fn lost_contacts(&self) -> u64 {
        self.lost
    }
}
