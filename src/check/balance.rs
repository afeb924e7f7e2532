//! Balances over many steps: what a stage loses by rounding the same way in every step, no comparison of single stages
//! can see.
//!
//! Every grain has to gain the momentum that forces, gravity and global damping have given it, and the path that its
//! velocity says; all together have to lose the energy that was dissipated. Forces are those that the engine itself
//! computes, so what is asked is only whether nothing of them got lost.

use crate::{
    body::{grains::clump, rotation::inverse_inertia},
    error::Result,
    measure::Sample,
    model::{Grains, Method, Precision},
    simulation::Simulation,
    space::precision::{low_of, position_low_of, spin_low_of},
    state::{ARRAYS, Array, State, array::*, present},
    units::Quantity,
};
use glam::DVec3;

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
    spin: DVec3,
    inverse_mass: f64,
    inverse_inertia: f64,
    radius: f64,
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

/// The balances of a simulation over its next steps. Energy is left out where walls or fixed grains move and do work.
///
/// # Errors
/// As [`Simulation::advance`].
pub fn balances(simulation: &mut Simulation, steps: u64) -> Result<Vec<Balance>> {
    let mut before = moving(simulation)?;
    let start = simulation.sample()?;
    let (mut sample, mut dissipated) = (start, 0.0);
    let mut accounts = vec![[Account::default(); 3]; before.len()];
    for _ in 0..steps {
        let rigid = simulation.model().method == Method::ContactDynamics;
        let forces = if rigid { Vec::new() } else { forces(simulation)? };
        simulation.advance(1)?;
        let forces = if rigid { self::forces(simulation)? } else { forces };
        let after = moving(simulation)?;
        let (p, nearest) = (*simulation.params(), simulation.assembly().domain);
        for (k, account) in accounts.iter_mut().enumerate() {
            let (a, b, (force, torque)) = (&before[k], &after[k], forces[k]);
            let path = p.dt * b.v;
            // Steps below the last place of a position are not followed.
            let place = p.quantum * 2.0_f64.powi(-25) / TOLERANCE;
            account[0].add(path, path.length() + place, nearest.nearest(b.x - a.x));
            if a.inverse_mass == 0.0 {
                continue;
            }
            // Global damping is implicit at the half step, in contact dynamics at the end of the step.
            let damped = |a: DVec3, b: DVec3| p.damping * if rigid { b } else { 0.5 * (a + b) };
            let kick = p.dt * (a.inverse_mass * force + p.gravity - damped(a.v, b.v));
            let turnover = p.dt * (a.inverse_mass * force.length() + p.gravity.length() + p.damping * a.v.length());
            account[1].add(kick, turnover, b.v - a.v);
            let turn = p.dt * (a.inverse_inertia * torque - damped(a.spin, b.spin));
            let turnover = p.dt * (a.inverse_inertia * a.radius * force.length() + p.damping * a.spin.length());
            account[2].add(turn, turnover, b.spin - a.spin);
        }
        before = after;
        let now = simulation.sample()?;
        dissipated += 0.5 * p.dt * (sample.dissipation + now.dissipation);
        sample = now;
    }
    let mut found: Vec<Balance> = ["path", "momentum", "angular momentum"]
        .into_iter()
        .enumerate()
        .map(|(row, of)| balance(of, tolerance(simulation.model().precision), accounts.iter().map(|all| &all[row])))
        .collect();
    if !works(simulation) && simulation.model().method == Method::DiscreteElements {
        let energy = |s: &Sample| s.kinetic_energy + s.potential_energy + s.elastic_energy;
        let changes = [
            sample.kinetic_energy - start.kinetic_energy,
            sample.potential_energy - start.potential_energy,
            sample.elastic_energy - start.elastic_energy,
            dissipated,
        ];
        // Sums of energies are rounded too.
        let largest = [start.kinetic_energy, start.potential_energy, start.elastic_energy];
        let scale = largest_of(&changes) + 1e-3 * largest_of(&largest);
        let lost = energy(&sample) - energy(&start) + dissipated;
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

/// Whether walls or fixed grains do work on grains.
fn works(simulation: &Simulation) -> bool {
    let assembly = simulation.assembly();
    let walls = assembly.walls.iter().any(|wall| wall.velocity != DVec3::ZERO || wall.spin != 0.0);
    walls || assembly.grains.iter().any(|g| g.fixed && (g.velocity != DVec3::ZERO || g.spin != DVec3::ZERO))
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

/// Forces and moments of contacts on grains, by number; of a clump those on its members.
fn forces(simulation: &mut Simulation) -> Result<Vec<(DVec3, DVec3)>> {
    let all = simulation.forces()?;
    if simulation.model().grains == Grains::Spheres {
        return Ok(all);
    }
    let assembly = simulation.assembly();
    let sum = |c| assembly.members(c).fold(DVec3::ZERO, |sum, member| sum + all[member].0);
    Ok((0..assembly.clumps.len()).map(|c| (sum(c), DVec3::ZERO)).collect())
}

/// Grains as the engine has them, velocities at the half step, by number. A clump spins along its own axes, so that its
/// spin is no sum of changes along those of the scene: it is left out.
fn moving(simulation: &mut Simulation) -> Result<Vec<Moving>> {
    let wanted: &[&'static Array] = match simulation.model().grains {
        Grains::Spheres => &[&ID, &POSITION, &POSITION_LOW, &VELOCITY, &SPIN, &VELOCITY_LOW],
        Grains::Clumps => &[
            &CENTER,
            &CENTER_LOW,
            &ORIENTATION,
            &ORIENTATION_LOW,
            &CLUMP_VELOCITY,
            &CLUMP_SPIN,
            &CLUMP_VELOCITY_LOW,
            &INVERSE_MOMENTS,
        ],
    };
    let arrays: Vec<_> = present(simulation.model(), ARRAYS).into_iter().filter(|a| wanted.contains(a)).collect();
    let s = simulation.read(&arrays)?;
    if s.model.grains == Grains::Clumps {
        return Ok((0..s.sizes.clumps).map(|c| moving_clump(s, c)).collect());
    }
    let mut moving: Vec<_> = (0..s.sizes.bodies).map(|i| (s.id[i], moving_sphere(s, i))).collect();
    moving.sort_by_key(|(id, _)| *id);
    Ok(moving.into_iter().map(|(_, moving)| moving).collect())
}

fn moving_sphere(s: &State, i: usize) -> Moving {
    let (v, w) = (s.velocity[i].v, s.spin.get(i).map_or(DVec3::ZERO, |spin| spin.0));
    let low = s.velocity_low.get(i).copied().unwrap_or_default();
    let inverse_mass = s.velocity[i].inverse_mass;
    Moving {
        x: s.position[i].x + position_low_of(s, i).x,
        v: v + low_of(s, Quantity::Velocity, v, low.v),
        spin: w + spin_low_of(s, w, low.spin),
        inverse_mass,
        inverse_inertia: inverse_inertia(s, &s.position[i], inverse_mass),
        radius: s.position[i].radius,
    }
}

fn moving_clump(s: &State, c: usize) -> Moving {
    let here = clump(s, c);
    let low = s.clump_velocity_low.get(c).copied().unwrap_or_default();
    Moving {
        x: here.center.x + here.center.low,
        v: here.velocity.v + low_of(s, Quantity::Velocity, here.velocity.v, low.v),
        spin: DVec3::ZERO,
        inverse_mass: here.velocity.inverse_mass,
        inverse_inertia: 0.0,
        radius: 0.0,
    }
}
