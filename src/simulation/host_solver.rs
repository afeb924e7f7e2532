//! A step of contact dynamics by the solvers of [`crate::solve`], in f64 on the host: grains in place of a matrix.

use super::runner::Runner;
use crate::{
    body::{
        grains::{arm_of, clump},
        rotation::{inverse_inertia, surface_velocity},
    },
    contact::materials::pair_of,
    error::Result,
    model::Grains as Kind,
    nscd::{
        compliance::compliance_at,
        contact::{NO_SPEED, active_entries, entry_of, impulse_inverse_mass, relative_velocity},
        response::{grain_of, inverse_inertia_of, point_response},
    },
    scene::Relaxation,
    solve::{Operator, Options, Problem, Solution, Solver, gauss_seidel, solve},
    state::{INDEX, Packed, Spin, State, Velocity, array::*, present},
};
use glam::{DMat3, DVec3};
use std::{ops::Mul, time::Instant};

/// A contact of the body with the smaller index, which belongs to grain `first`.
struct Contact {
    first: usize,
    /// The other grain. None: a wall.
    second: Option<usize>,
    /// Entries of the two in their lists.
    entry: usize,
    entry_to: Option<usize>,
    /// From first to second, and two tangents; in the plane the second one leads out of it.
    axes: [DVec3; 3],
    /// m, from the centres of the grains to the contact point.
    arm: DVec3,
    arm_to: DVec3,
    /// m/s, in its frame: q.
    free: DVec3,
    friction: f64,
    /// 1/kg, in its frame: C.
    compliance: DVec3,
}

impl Contact {
    /// Impulse on the first grain, N s, from one in the contact's frame.
    fn impulse(&self, r: DVec3) -> DVec3 {
        let [n, s, t] = self.axes;
        r.y * s + r.z * t - r.x * n
    }

    /// The other way round.
    fn in_frame(&self, impulse: DVec3) -> DVec3 {
        let [n, s, t] = self.axes;
        DVec3::new(-impulse.dot(n), impulse.dot(s), impulse.dot(t))
    }
}

/// The inverse inertia of a grain: a number or a matrix.
trait Inertia: Copy + Mul<DVec3, Output = DVec3> {}
impl Inertia for f64 {}
impl Inertia for DMat3 {}

/// What impulses do to a grain.
struct Grain<I> {
    /// 1/kg and 1/(kg m²)
    inverse_mass: f64,
    inverse_inertia: I,
    /// Its contacts.
    contact_ids: Vec<usize>,
}

/// The contacts of a step, and what impulses do to the grains.
struct Grains<I> {
    dims: usize,
    contact_ids: Vec<Contact>,
    grains: Vec<Grain<I>>,
    reference: f64,
    /// m/s, what acts on the contacts.
    speeds: Vec<f64>,
}

impl<I: Inertia> Grains<I> {
    /// The contacts of a state. Body i belongs to the grain `of_body(i).0`, from whose centre it lies `of_body(i).1`
    /// away.
    fn new(s: &State, grains: Vec<Grain<I>>, of_body: impl Fn(usize) -> (usize, DVec3)) -> Grains<I> {
        let mut grains = Grains {
            dims: s.model.dims(),
            contact_ids: Vec::new(),
            grains,
            reference: s.solver_state[0].scale,
            speeds: Vec::new(),
        };
        for i in 0..s.sizes.bodies {
            for entry in active_entries(s, i) {
                let j = (s.neighbour[entry] & INDEX) as usize;
                if j >= i {
                    grains.add_contact(s, i, j, entry, &of_body);
                }
            }
        }
        grains
    }

    fn add_contact(&mut self, s: &State, i: usize, j: usize, entry: usize, of_body: impl Fn(usize) -> (usize, DVec3)) {
        let (geometry, inverse_effective_mass) = (s.contact_geometry[entry], s.inverse_effective_mass[entry]);
        let tangents = match self.dims {
            2 => (DVec3::new(-geometry.n.y, geometry.n.x, 0.0), DVec3::Z),
            _ => geometry.n.any_orthonormal_pair(),
        };
        let compliance = compliance_at(s, i, entry);
        let wall = j.checked_sub(s.sizes.bodies);
        let (first, to_first) = of_body(i);
        let second = wall.is_none().then(|| of_body(j));
        let k = self.contact_ids.len();
        self.grains[first].contact_ids.push(k);
        if let Some((second, _)) = second {
            self.grains[second].contact_ids.push(k);
        }
        let mut contact = Contact {
            first,
            second: second.map(|(second, _)| second),
            entry,
            entry_to: wall.is_none().then(|| entry_of(s, j, i)),
            axes: [geometry.n, tangents.0, tangents.1],
            arm: to_first + inverse_effective_mass.arm * geometry.n,
            arm_to: second.map_or(DVec3::ZERO, |(_, to_second)| to_second - inverse_effective_mass.arm_to * geometry.n),
            free: DVec3::ZERO,
            friction: pair_of(s, i, j).friction,
            compliance: DVec3::new(compliance.normal, compliance.tangential, compliance.tangential),
        };
        contact.free = contact.in_frame(s.free_contact_velocity[entry].0);
        self.contact_ids.push(contact);
        self.speeds.push(geometry.speed.max(NO_SPEED));
    }
}

/// What impulses have done.
#[derive(Clone)]
struct Pushed {
    /// Velocities and spins that they have added to those of the grains.
    grains: Vec<(DVec3, DVec3)>,
    /// N s, of the contacts in their frames.
    impulses: Vec<DVec3>,
}

impl<I: Inertia> Operator for Grains<I> {
    type State = Pushed;

    fn len(&self) -> usize {
        self.contact_ids.len()
    }

    fn dims(&self) -> usize {
        self.dims
    }

    fn block(&self, k: usize) -> DMat3 {
        let m = &self.contact_ids[k];
        let velocity = |grain: usize, arm: DVec3, impulse: DVec3| {
            let Grain { inverse_mass, inverse_inertia, .. } = self.grains[grain];
            point_response(inverse_mass, inverse_inertia, arm, impulse)
        };
        let column = |axis: DVec3| {
            let impulse = m.impulse(axis);
            let to = m.second.map_or(DVec3::ZERO, |second| velocity(second, m.arm_to, impulse));
            m.in_frame(velocity(m.first, m.arm, impulse) + to)
        };
        let out = if self.dims == 2 { DVec3::ZERO } else { column(DVec3::Z) };
        let compliance = if self.dims == 2 { m.compliance.with_z(0.0) } else { m.compliance };
        DMat3::from_cols(column(DVec3::X), column(DVec3::Y), out) + DMat3::from_diagonal(compliance)
    }

    fn mu(&self, k: usize) -> f64 {
        self.contact_ids[k].friction
    }

    fn reference(&self) -> f64 {
        self.reference
    }

    fn speeds(&self) -> Option<&[f64]> {
        Some(&self.speeds)
    }

    fn free(&self) -> Self::State {
        Pushed { grains: vec![(DVec3::ZERO, DVec3::ZERO); self.grains.len()], impulses: vec![DVec3::ZERO; self.len()] }
    }

    fn set(&self, state: &mut Self::State, r: &[DVec3]) {
        state.grains.fill((DVec3::ZERO, DVec3::ZERO));
        state.impulses.fill(DVec3::ZERO);
        r.iter().enumerate().for_each(|(k, r)| self.add(state, k, *r));
    }

    fn velocity(&self, state: &Self::State, k: usize) -> DVec3 {
        let m = &self.contact_ids[k];
        let second = m.second.map_or((DVec3::ZERO, DVec3::ZERO), |j| state.grains[j]);
        let pushed = m.in_frame(relative_velocity(state.grains[m.first], m.arm, second, m.arm_to));
        pushed + m.compliance * state.impulses[k] + m.free
    }

    fn add(&self, state: &mut Self::State, k: usize, change: DVec3) {
        let m = &self.contact_ids[k];
        let impulse = m.impulse(change);
        state.impulses[k] += change;
        let mut push = |i: usize, arm: DVec3, impulse: DVec3| {
            let Grain { inverse_mass, inverse_inertia, .. } = self.grains[i];
            state.grains[i].0 += inverse_mass * impulse;
            state.grains[i].1 += inverse_inertia * arm.cross(impulse);
        };
        push(m.first, m.arm, impulse);
        if let Some(j) = m.second {
            push(j, m.arm_to, -impulse);
        }
    }

    fn extrapolate(&self, state: &mut Self::State, newer: &Self::State, older: &Self::State, beta: f64) {
        let ahead = |newer: DVec3, older: DVec3| newer + beta * (newer - older);
        for ((state, newer), older) in state.grains.iter_mut().zip(&newer.grains).zip(&older.grains) {
            *state = (ahead(newer.0, older.0), ahead(newer.1, older.1));
        }
        for ((state, newer), older) in state.impulses.iter_mut().zip(&newer.impulses).zip(&older.impulses) {
            *state = ahead(*newer, *older);
        }
    }

    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> {
        let m = &self.contact_ids[k];
        let second = m.second.into_iter().flat_map(|j| &self.grains[j].contact_ids);
        self.grains[m.first].contact_ids.iter().chain(second).copied()
    }
}

/// Solve the contacts of a state, and leave impulses and velocities in it. Times in the answer are since `began`.
fn solve_state(s: &mut State, solver: Solver, options: &Options, began: Instant) -> Result<Solution> {
    match s.model.grains {
        Kind::Spheres => {
            let of_body = |i| {
                let inverse_mass = impulse_inverse_mass(s, i);
                let inverse_inertia = inverse_inertia(s, &s.position[i], inverse_mass);
                Grain { inverse_mass, inverse_inertia, contact_ids: Vec::new() }
            };
            let grains = (0..s.sizes.bodies).map(of_body).collect();
            solve_grains(
                &Grains::new(s, grains, |i| (i, DVec3::ZERO)),
                s,
                |_, i| (i, DVec3::ZERO),
                solver,
                options,
                began,
            )
        }
        Kind::Clumps => {
            let of_clump = |c: usize| Grain {
                inverse_mass: s.clump_velocity_next[c].inverse_mass,
                inverse_inertia: inverse_inertia_of(s, &clump(s, c)),
                contact_ids: Vec::new(),
            };
            let grains = (0..s.sizes.clumps).map(of_clump).collect();
            let of_body = |s: &State, i: usize| {
                let c = grain_of(s, i) as usize;
                (c, arm_of(s, clump(s, c).orientation, s.id[i] as usize))
            };
            solve_grains(&Grains::new(s, grains, |i| of_body(s, i)), s, of_body, solver, options, began)
        }
    }
}

fn solve_grains<I: Inertia>(
    grains: &Grains<I>,
    s: &mut State,
    of_body: impl Fn(&State, usize) -> (usize, DVec3),
    solver: Solver,
    options: &Options,
    began: Instant,
) -> Result<Solution> {
    if grains.is_empty() {
        return Ok(Solution::default());
    }
    let start: Vec<DVec3> = grains.contact_ids.iter().map(|m| m.in_frame(s.impulse[m.entry].0)).collect();
    let swept = solver == Solver::GaussSeidel;
    let problem = if swept { None } else { Some(Problem::of(grains)?) };
    let before = began.elapsed().as_secs_f64();
    let mut solution = match &problem {
        None => gauss_seidel::solve(grains, start, options),
        Some(problem) => solve(problem, solver, options)?,
    };
    solution.history.iter_mut().for_each(|record| record.seconds += before);
    let mut state = grains.free();
    grains.set(&mut state, &solution.r);
    for i in 0..s.sizes.bodies {
        let (grain, arm) = of_body(s, i);
        let (v, spin) = state.grains[grain];
        s.pass_velocity[i] =
            Velocity { v: v + surface_velocity(spin, arm), inverse_mass: grains.grains[grain].inverse_mass };
        if let Some(kept) = s.pass_spin.get_mut(i) {
            *kept = Spin(spin);
        }
    }
    for (m, r) in grains.contact_ids.iter().zip(&solution.r) {
        let impulse = m.impulse(*r);
        s.impulse[m.entry] = Packed(impulse);
        if let Some(entry) = m.entry_to {
            s.impulse[entry] = Packed(-impulse);
        }
    }
    Ok(solution)
}

/// The passes of a step. Times in the answer are since `began`.
///
/// # Errors
/// [`crate::Error::Device`] if arrays cannot be moved, and what the solver says.
pub fn solve_step(
    runner: &mut Runner,
    relaxation: &Relaxation,
    began: Instant,
    interrupted: fn() -> bool,
) -> Result<Solution> {
    let needed = [
        &POSITION,
        &VELOCITY,
        &SPIN,
        &CLUMP_OF_ID,
        &MEMBER_OFFSET,
        &CENTER,
        &CENTER_LOW,
        &ORIENTATION,
        &ORIENTATION_LOW,
        &INVERSE_MOMENTS,
        &CLUMP_VELOCITY,
        &CLUMP_VELOCITY_NEXT,
        &CLUMP_SPIN,
        &CLUMP_SPIN_NEXT,
        &WALL,
        &ID,
        &MATERIAL,
        &LIST_START,
        &NEIGHBOUR,
        &CONTACT_GEOMETRY,
        &FREE_CONTACT_VELOCITY,
        &INVERSE_EFFECTIVE_MASS,
        &IMPULSE,
        &PASS_VELOCITY,
        &PASS_SPIN,
        &SOLVER_STATE,
    ];
    let model = runner.state.model;
    runner.read(&present(&model, &needed))?;
    let options = Options {
        tolerance: relaxation.tolerance,
        max_iterations: relaxation.max_iterations as usize,
        order: relaxation.order,
        seed: runner.step,
        interrupted,
        ..Options::default()
    };
    let solution = solve_state(&mut runner.state, relaxation.solver, &options, began)?;
    runner.engine.write(&present(&model, &[&IMPULSE, &PASS_VELOCITY, &PASS_SPIN]), 0, &runner.state)?;
    Ok(solution)
}
