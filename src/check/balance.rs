//! Balances over many steps: what a stage loses by rounding the same way in every step, no comparison of single stages
//! can see.
//!
//! Every grain has to gain the momentum that forces, gravity and global damping have given it, and the path that its
//! velocity says; a clump what the products of its angular velocities give to its spin, and the attitude that its spin
//! says; all together have to lose the energy that was dissipated. Forces are those that the engine itself computes, so
//! what is asked is only whether nothing of them got lost.

use crate::{
    body::{
        grains::{Clump, clump, spins_in_scene},
        rotation::inverse_inertia,
    },
    error::Result,
    measure::Sample,
    model::{Boundary, Dimension, Grains, Method, Precision},
    nscd::{
        contact::{damping_factor, free_spin_change},
        gyroscopic::free_spin_change_of_clump,
    },
    scene::{self, Assembly, Grain, Wall},
    simulation::Simulation,
    space::{
        boundary::transformed,
        dimension::{conjugate, gyroscopic, quaternion_product, rotate, rotation_increment},
        precision::{low_of, position_low_of, spin_low_of},
    },
    state::{ARRAYS, Array, Cell, State, array::*, present},
    units::Quantity,
};
use glam::{DVec3, DVec4, Vec4Swizzles};

/// Steps over which benchmarks look at balances.
pub const BALANCED_STEPS: u64 = 100;

/// What was gained and what should have been, over what came and went; worst of all grains.
#[derive(Clone, Copy, Debug)]
pub struct Balance {
    pub of: &'static str,
    pub worst: f64,
    pub rms: f64,
    /// What is right.
    pub tolerance: f64,
}

impl Balance {
    /// Whether nothing got lost.
    pub fn holds(&self) -> bool {
        self.worst <= self.tolerance
    }
}

/// A grain, in its own units.
#[derive(Clone, Copy, Debug)]
struct Moving {
    x: DVec3,
    v: DVec3,
    /// Along the axes of the scene, or of a clump along its own, if it turns there.
    spin: DVec3,
    in_scene: bool,
    inverse_mass: f64,
    inverse_moments: DVec3,
    /// Unit quaternion; of spheres, which have no axes, 1.
    attitude: DVec4,
    /// Contact dynamics: what the products of angular velocities change the spin by in the next step, per time.
    products: DVec3,
}

impl Moving {
    /// What a moment about the axes of the scene accelerates the spin by.
    fn accelerated(&self, moment: DVec3) -> DVec3 {
        let own = self.inverse_moments * rotate(conjugate(self.attitude), moment);
        if self.in_scene { rotate(self.attitude, own) } else { own }
    }

    /// Twice the vector of the quaternion that turns this attitude into a later one, about the axes of the spin.
    fn turned(&self, later: &Moving) -> DVec3 {
        let (from, to) = (conjugate(self.attitude), later.attitude);
        2.0 * if self.in_scene { quaternion_product(to, from) } else { quaternion_product(from, to) }.xyz()
    }
}

/// What contacts do to a grain, in the scene's units.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    force: DVec3,
    moment: DVec3,
    /// The same moment if none of its parts balanced another.
    turnover: f64,
}

/// What should have been gained, what came and went, and what was gained.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    due: DVec3,
    turnover: f64,
    gained: DVec3,
}

impl Account {
    fn add(&mut self, due: DVec3, turnover: f64, gained: DVec3) {
        self.due += due;
        self.turnover += turnover;
        self.gained += gained;
    }
}

/// The flow of the cell in a step: its gradient, and where it stands still; none but in a cell that deforms.
#[derive(Clone, Copy, Debug, Default)]
struct Flow {
    rate: DVec3,
    shear_rate: DVec3,
    origin: DVec3,
}

impl Flow {
    /// By how much it is faster further on by this.
    fn over(&self, way: DVec3) -> DVec3 {
        transformed(self.rate, self.shear_rate, way)
    }
}

/// The balances of a simulation over its next steps, of those in which no grain comes or goes. Energy is left out where
/// walls, fixed grains or the cell move and do work, or grains come and go, and angular momentum of rigid grains where walls
/// move, which have gone on from where their impulses acted. Where damping adapts itself there is none: what it has taken of
/// velocities nobody knows.
///
/// # Errors
/// As [`Simulation::advance`].
pub fn balances(simulation: &mut Simulation, steps: u64) -> Result<Vec<Balance>> {
    let model = *simulation.model();
    if model.adaptive_damping {
        return Ok(Vec::new());
    }
    let (mut before, _) = moving(simulation)?;
    let start = simulation.sample()?;
    let (mut sample, mut dissipated, mut of_growth) = (start, 0.0, 0.0);
    let rigid = model.method == Method::ContactDynamics;
    let walls_move = simulation.assembly().walls.iter().any(Wall::moves);
    let mut accounts = vec![[Account::default(); 4]; before.len()];
    let mut of_others = Vec::new();
    for _ in 0..steps {
        let loads = if rigid { Vec::new() } else { loads(simulation, &before)? };
        let there = simulation.assembly().changes().then(|| numbers(simulation));
        simulation.advance(1)?;
        if there.is_some_and(|there| there != numbers(simulation)) {
            (before, _) = moving(simulation)?;
            of_others.append(&mut accounts);
            accounts.resize(before.len(), Default::default());
            continue;
        }
        let loads = if rigid { self::loads(simulation, &before)? } else { loads };
        let (after, flow) = moving(simulation)?;
        let (p, nearest) = (*simulation.params(), simulation.domain()?);
        for (k, account) in accounts.iter_mut().enumerate() {
            let (a, b, load) = (&before[k], &after[k], &loads[k]);
            let path = p.dt * (b.v + flow.over(a.x - flow.origin + 0.5 * p.dt * b.v));
            // Steps below the last place of a position are not followed.
            let place = p.quantum * 2.0_f64.powi(-25) / TOLERANCE;
            account[0].add(path, path.length() + place, nearest.nearest(b.x - a.x));
            let turn = 2.0 * rotation_increment(0.25 * p.dt * b.spin).xyz();
            // Nor turns below that of an attitude here.
            let place = 4.0 * f64::EPSILON / tolerance(model.precision);
            account[3].add(turn, turn.length() + place, a.turned(b));
            if a.inverse_mass == 0.0 {
                continue;
            }
            // Global damping is implicit at the half step, in contact dynamics at the end of the step.
            let damped = |a: DVec3, b: DVec3| p.damping * if rigid { b } else { 0.5 * (a + b) };
            let acceleration = a.inverse_mass * load.force + p.gravity;
            // The way to faster or slower flow changes velocities past it, too.
            let (kick, passed) = if rigid {
                (p.dt * (acceleration - damped(a.v, b.v)), p.dt * flow.over(a.v))
            } else {
                let half = 0.5 * p.dt * p.damping;
                let kick = (p.dt * acceleration - 2.0 * half * a.v) / (1.0 + half);
                (kick, p.dt * flow.over(a.v + 0.5 * kick))
            };
            let came = a.inverse_mass * load.force.length() + p.gravity.length() + p.damping * a.v.length();
            account[1].add(kick - passed, p.dt * came + passed.length(), b.v - a.v);
            let products = if rigid { a.products } else { products(model.dimension, a, 0.5 * (a.spin + b.spin)) };
            let kick = p.dt * (a.accelerated(load.moment) + products - damped(a.spin, b.spin));
            // Products are rounded too, and what is left of them may be little.
            let rounded = if products == DVec3::ZERO { 0.0 } else { 1e-3 * a.spin.length_squared() };
            let came = a.inverse_moments.max_element() * load.turnover
                + products.length()
                + rounded
                + p.damping * a.spin.length();
            account[2].add(kick, p.dt * came, b.spin - a.spin);
        }
        before = after;
        let now = simulation.sample()?;
        dissipated += 0.5 * p.dt * (sample.dissipation + now.dissipation);
        of_growth += 0.5 * p.dt * (sample.growth_power + now.growth_power);
        sample = now;
    }
    let mut found: Vec<Balance> = ["path", "momentum", "angular momentum", "attitude"]
        .into_iter()
        .enumerate()
        .filter(|(_, of)| *of != "attitude" || model.grains == Grains::Clumps)
        .filter(|(_, of)| *of != "angular momentum" || !(rigid && walls_move))
        .map(|(row, of)| {
            balance(of, tolerance(model.precision), accounts.iter().chain(&of_others).map(|all| &all[row]))
        })
        .collect();
    if !works(simulation) && !rigid {
        let energy = |s: &Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let changes = [
            sample.kinetic_energy - start.kinetic_energy,
            sample.potential_energy - start.potential_energy,
            sample.elastic_energy - start.elastic_energy,
            dissipated,
            of_growth,
        ];
        // Sums of energies are rounded too.
        let largest = [start.kinetic_energy, start.potential_energy, start.elastic_energy];
        let scale = largest_of(&changes) + 1e-3 * largest_of(&largest);
        let lost = energy(&sample) - energy(&start) + dissipated - of_growth;
        let worst = if lost == 0.0 { 0.0 } else { lost.abs() / scale };
        found.push(Balance { of: "energy", worst, rms: worst, tolerance: ENERGY_TOLERANCE });
    }
    Ok(found)
}

/// What may be missing in single precision.
const TOLERANCE: f64 = 1e-4;

/// The integrator itself keeps energy no better than to the square of ω Δt.
const ENERGY_TOLERANCE: f64 = 1e-2;

/// The largest balance of forces that is right.
fn tolerance(precision: Precision) -> f64 {
    match precision {
        Precision::Single => TOLERANCE,
        Precision::Double => 1e-6,
    }
}

fn largest_of(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// What particles are called.
fn numbers(simulation: &Simulation) -> Vec<u32> {
    let Assembly { clumps, numbers, .. } = simulation.assembly();
    let of = |k: usize| if clumps.is_empty() { numbers.of_grain(k) } else { numbers.of_clump(k) };
    (0..simulation.particles()).map(of).collect()
}

/// Whether walls, fixed grains, the cell or those who come and go do work on grains.
fn works(simulation: &Simulation) -> bool {
    let assembly = simulation.assembly();
    let walls = assembly.walls.iter().any(|wall| wall.moves() || wall.spin != 0.0);
    walls
        || assembly.deforms()
        || assembly.changes()
        || assembly.grains.iter().any(|g| g.fixed && (g.velocity != DVec3::ZERO || g.spin != DVec3::ZERO))
}

fn balance<'a>(of: &'static str, tolerance: f64, accounts: impl Iterator<Item = &'a Account>) -> Balance {
    let (mut worst, mut squares, mut count) = (0.0_f64, 0.0, 0.0);
    for account in accounts {
        let missing = (account.gained - account.due).length();
        let relative = if missing == 0.0 { 0.0 } else { missing / account.turnover };
        worst = if relative.is_nan() { f64::INFINITY } else { worst.max(relative) };
        squares += relative * relative;
        count += 1.0;
    }
    Balance { of, worst, rms: (squares / f64::max(count, 1.0)).sqrt(), tolerance }
}

/// What contacts do to grains, by number; to a clump about its centre, in the attitude it has before the step.
fn loads(simulation: &mut Simulation, before: &[Moving]) -> Result<Vec<Load>> {
    let forces = match simulation.model().method {
        Method::DiscreteElements => simulation.forces()?,
        Method::ContactDynamics => simulation.forces_of_last_step()?,
    };
    let assembly = simulation.assembly();
    if simulation.model().grains == Grains::Spheres {
        let of = |((force, moment), g): (&(DVec3, DVec3), &Grain)| Load {
            force: *force,
            moment: *moment,
            turnover: g.radius * force.length(),
        };
        return Ok(forces.iter().zip(&assembly.grains).map(of).collect());
    }
    let of = |(c, clump): (usize, &scene::Clump)| {
        let members = assembly.members(c).zip(&assembly.shapes[clump.shape as usize].members);
        members.fold(Load::default(), |sum, (id, member)| {
            let ((force, moment), arm) = (forces[id], clump.radius * rotate(before[c].attitude, member.arm));
            Load {
                force: sum.force + force,
                moment: sum.moment + moment + arm.cross(force),
                turnover: sum.turnover + (arm.length() + clump.radius * member.radius) * force.length(),
            }
        })
    };
    Ok(assembly.clumps.iter().enumerate().map(of).collect())
}

/// What the products of these angular velocities, along the axes of the spin, accelerate it by.
fn products(dimension: Dimension, here: &Moving, spin: DVec3) -> DVec3 {
    // Where the spin is kept along the axes of the scene, all moments are the same.
    if here.in_scene { DVec3::ZERO } else { here.inverse_moments * gyroscopic(dimension, spin, here.inverse_moments) }
}

/// Grains as the engine has them, velocities at the half step, by number, and the flow that they have come with.
fn moving(simulation: &mut Simulation) -> Result<(Vec<Moving>, Flow)> {
    let wanted: &[&'static Array] = match simulation.model().grains {
        Grains::Spheres => &[&ID, &POSITION, &POSITION_LOW, &VELOCITY, &SPIN, &VELOCITY_LOW, &CELL],
        Grains::Clumps => &[
            &CENTER,
            &CENTER_LOW,
            &ORIENTATION,
            &ORIENTATION_LOW,
            &ORIENTATION_REST,
            &CLUMP_VELOCITY,
            &CLUMP_SPIN,
            &CLUMP_VELOCITY_LOW,
            &INVERSE_MOMENTS,
            &CELL,
        ],
    };
    let arrays: Vec<_> = present(simulation.model(), ARRAYS).into_iter().filter(|a| wanted.contains(a)).collect();
    let s = simulation.read(&arrays)?;
    let of_cell = |cell: &Cell| Flow { rate: cell.rate, shear_rate: cell.shear_rate.0, origin: s.params.cell_origin };
    let flow = if s.model.boundary == Boundary::Deforming { of_cell(&s.cell[0]) } else { Flow::default() };
    if s.model.grains == Grains::Clumps {
        return Ok(((0..s.sizes.clumps).map(|c| moving_clump(s, c)).collect(), flow));
    }
    let mut moving: Vec<_> = (0..s.sizes.bodies).map(|i| (s.id[i], moving_sphere(s, i))).collect();
    moving.sort_by_key(|(id, _)| *id);
    Ok((moving.into_iter().map(|(_, moving)| moving).collect(), flow))
}

fn moving_sphere(s: &State, i: usize) -> Moving {
    let (v, w) = (s.velocity[i].v, s.spin.get(i).map_or(DVec3::ZERO, |spin| spin.0));
    let low = s.velocity_low.get(i).copied().unwrap_or_default();
    let inverse_mass = s.velocity[i].inverse_mass;
    Moving {
        x: s.position[i].x + position_low_of(s, i).x,
        v: v + low_of(s, Quantity::Velocity, v, low.v),
        spin: w + spin_low_of(s, w, low.spin),
        in_scene: true,
        inverse_mass,
        inverse_moments: DVec3::splat(inverse_inertia(s, &s.position[i], inverse_mass)),
        attitude: DVec4::W,
        products: DVec3::ZERO,
    }
}

fn moving_clump(s: &State, c: usize) -> Moving {
    let known = clump(s, c);
    let low = s.clump_velocity_low.get(c).copied().unwrap_or_default();
    let rest = s.orientation_rest.get(c).map_or(DVec4::ZERO, |rest| rest.0);
    let here = Clump {
        orientation: (known.orientation + rest).normalize(),
        spin: known.spin + spin_low_of(s, known.spin, low.spin),
        ..known
    };
    let products = match s.model.method {
        Method::DiscreteElements => DVec3::ZERO,
        // Damping of the end of the step takes its part of them too.
        Method::ContactDynamics => {
            let free = free_spin_change_of_clump(s, &here).spin - free_spin_change(s, &here.velocity, here.spin);
            free / (damping_factor(s) * s.params.dt)
        }
    };
    Moving {
        x: here.center.x + here.center.low,
        v: here.velocity.v + low_of(s, Quantity::Velocity, here.velocity.v, low.v),
        spin: here.spin,
        in_scene: spins_in_scene(&s.model, here.inverse_moments),
        inverse_mass: here.velocity.inverse_mass,
        inverse_moments: here.inverse_moments,
        attitude: here.orientation,
        products,
    }
}
