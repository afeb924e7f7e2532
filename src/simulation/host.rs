//! A step of contact dynamics by the solvers of [`crate::cd`], in f64 on the host: grains in place of a matrix.

use super::{Simulation, rigid::Look};
use crate::{
    cd::{Operator, Options, Problem, Record, Solution, Solver, gauss_seidel, solve},
    error::Result,
    laws::{
        materials::pair_of,
        rigid::{filled, freed, freed_spin, taking_part},
        rotation::{inverse_inertia, spin_of, surface_velocity},
        walls::wall_velocity,
    },
    scene::Relaxation,
    state::{INDEX, Motion, Packed, Spin, State},
};
use glam::{DMat3, DVec3};
use std::time::Instant;

/// A contact of the grain with the smaller index, `first`.
struct Meeting {
    first: usize,
    /// None: a wall, with the velocity of its surface, m/s.
    second: Option<usize>,
    wall: DVec3,
    /// Slots of the two in their lists.
    slot: usize,
    slot_to: Option<usize>,
    /// From first to second, and two tangents; in the plane the second one leads out of it.
    axes: [DVec3; 3],
    /// m, from the centres to the contact point.
    arm: f64,
    arm_to: f64,
    /// m/s
    closing: f64,
    /// 1/kg, W along and across n.
    weight: DVec3,
    friction: f64,
}

impl Meeting {
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

/// The contacts of a step, and what impulses do to the grains.
struct Grains {
    dims: usize,
    meetings: Vec<Meeting>,
    /// Contacts of every grain.
    of_grain: Vec<Vec<usize>>,
    /// Velocity, m/s, and spin, rad/s, without any impulse.
    free: Vec<(DVec3, DVec3)>,
    /// 1/kg and 1/(kg m²)
    inverse: Vec<(f64, f64)>,
    reference: f64,
}

impl Grains {
    fn new(s: &State) -> Grains {
        let dims = s.model.dims();
        let bodies = s.sizes.bodies;
        let free = (0..bodies).map(|i| (freed(s, &s.motion[i]).v, freed_spin(s, &s.motion[i], spin_of(s, i))));
        let inverse = (0..bodies).map(|i| {
            let inverse_mass = freed(s, &s.motion[i]).inverse_mass;
            (inverse_mass, inverse_inertia(s, &s.place[i], inverse_mass))
        });
        let mut grains = Grains {
            dims,
            meetings: Vec::new(),
            of_grain: vec![Vec::new(); bodies],
            free: free.collect(),
            inverse: inverse.collect(),
            reference: s.relaxation[0].scale,
        };
        for i in 0..bodies {
            for slot in taking_part(s, i) {
                let j = (s.neighbour[slot] & INDEX) as usize;
                if j >= i {
                    grains.add_meeting(s, i, j, slot);
                }
            }
        }
        grains
    }

    fn add_meeting(&mut self, s: &State, i: usize, j: usize, slot: usize) {
        let (met, lever) = (s.meeting[slot], s.lever[slot]);
        let tangents = match self.dims {
            2 => (DVec3::new(-met.n.y, met.n.x, 0.0), DVec3::Z),
            _ => met.n.any_orthonormal_pair(),
        };
        let wall = j.checked_sub(s.sizes.bodies);
        let back = |j: usize| filled(s, j).find(|&back| (s.neighbour[back] & INDEX) as usize == i);
        let k = self.meetings.len();
        self.of_grain[i].push(k);
        if wall.is_none() {
            self.of_grain[j].push(k);
        }
        self.meetings.push(Meeting {
            first: i,
            second: wall.is_none().then_some(j),
            wall: wall.map_or(DVec3::ZERO, |w| wall_velocity(&s.wall[w], s.place[i].x + lever.own * met.n)),
            slot,
            slot_to: if wall.is_none() { back(j) } else { None },
            axes: [met.n, tangents.0, tangents.1],
            arm: lever.own,
            arm_to: lever.other,
            closing: met.closing,
            weight: DVec3::new(lever.normal, lever.tangential, if self.dims == 2 { 0.0 } else { lever.tangential }),
            friction: pair_of(s, i, j).friction,
        });
    }
}

/// The state are the velocities of the grains.
impl Operator for Grains {
    type State = Vec<(DVec3, DVec3)>;

    fn len(&self) -> usize {
        self.meetings.len()
    }

    fn dims(&self) -> usize {
        self.dims
    }

    fn block(&self, k: usize) -> DMat3 {
        DMat3::from_diagonal(self.meetings[k].weight)
    }

    fn mu(&self, k: usize) -> f64 {
        self.meetings[k].friction
    }

    fn reference(&self) -> f64 {
        self.reference
    }

    fn free(&self) -> Self::State {
        self.free.clone()
    }

    fn set(&self, state: &mut Self::State, r: &[DVec3]) {
        state.copy_from_slice(&self.free);
        r.iter().enumerate().for_each(|(k, r)| self.add(state, k, *r));
    }

    fn velocity(&self, state: &Self::State, k: usize) -> DVec3 {
        let m = &self.meetings[k];
        let n = m.axes[0];
        let (v, spin) = state[m.first];
        let (v_to, spin_to) = m.second.map_or((m.wall, DVec3::ZERO), |j| state[j]);
        let surface = surface_velocity(spin, m.arm * n) - surface_velocity(spin_to, -m.arm_to * n);
        m.in_frame((v - v_to) + surface) + m.closing * DVec3::X
    }

    fn add(&self, state: &mut Self::State, k: usize, change: DVec3) {
        let m = &self.meetings[k];
        let impulse = m.impulse(change);
        let mut push = |i: usize, arm: DVec3, impulse: DVec3| {
            let (inverse_mass, inverse_inertia) = self.inverse[i];
            state[i].0 += inverse_mass * impulse;
            state[i].1 += inverse_inertia * arm.cross(impulse);
        };
        push(m.first, m.arm * m.axes[0], impulse);
        if let Some(j) = m.second {
            push(j, -m.arm_to * m.axes[0], -impulse);
        }
    }

    fn extrapolate(&self, state: &mut Self::State, newer: &Self::State, older: &Self::State, beta: f64) {
        for ((state, newer), older) in state.iter_mut().zip(newer).zip(older) {
            *state = (newer.0 + beta * (newer.0 - older.0), newer.1 + beta * (newer.1 - older.1));
        }
    }

    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> {
        let m = &self.meetings[k];
        let second = m.second.into_iter().flat_map(|j| &self.of_grain[j]);
        self.of_grain[m.first].iter().chain(second).copied()
    }
}

/// Whether a step can be left to the engine's own passes.
pub(super) fn on_engine(solver: Solver) -> bool {
    matches!(solver, Solver::Jacobi | Solver::JacobiAccelerated | Solver::ColouredAccelerated)
}

/// Solve the contacts that a state has met, and leave impulses and velocities in it. Times in the answer are since `began`.
fn solve_state(s: &mut State, relaxation: &Relaxation, step: u64, began: Instant) -> Result<Solution> {
    let grains = Grains::new(s);
    if grains.is_empty() {
        return Ok(Solution::default());
    }
    let start: Vec<DVec3> = grains.meetings.iter().map(|m| m.in_frame(s.spring[m.slot].0)).collect();
    let options = Options {
        tolerance: relaxation.tolerance,
        max_iterations: relaxation.max_iterations as usize,
        order: relaxation.order,
        seed: step,
        ..Options::default()
    };
    let swept = relaxation.solver == Solver::GaussSeidel;
    let problem = if swept { None } else { Some(Problem::of(&grains)?) };
    let before = began.elapsed().as_secs_f64();
    let mut solution = match &problem {
        None => gauss_seidel::solve(&grains, start, &options),
        Some(problem) => solve(problem, relaxation.solver, &options)?,
    };
    solution.history.iter_mut().for_each(|record| record.seconds += before);
    let mut state = grains.free();
    grains.set(&mut state, &solution.r);
    for (i, (v, spin)) in state.into_iter().enumerate() {
        s.trial[i] = Motion { v, inverse_mass: grains.inverse[i].0 };
        if let Some(kept) = s.trial_spin.get_mut(i) {
            *kept = Spin(spin);
        }
    }
    for (m, r) in grains.meetings.iter().zip(&solution.r) {
        let impulse = m.impulse(*r);
        s.spring[m.slot] = Packed(impulse);
        if let Some(slot) = m.slot_to {
            s.spring[slot] = Packed(-impulse);
        }
    }
    Ok(solution)
}

impl Simulation {
    /// All passes of a step, after those that it took before: how many there are now.
    pub(super) fn relax_on_host(&mut self, relaxation: &Relaxation, passes: u32, began: Instant) -> Result<u32> {
        const READ: [&str; 12] = [
            "place",
            "motion",
            "spin",
            "wall",
            "number",
            "material",
            "slot_start",
            "neighbour",
            "meeting",
            "lever",
            "spring",
            "relaxation",
        ];
        let present = |names: &[&'static str], s: &State| -> Vec<&'static str> {
            names.iter().copied().filter(|name| !s.column(name).is_empty()).collect()
        };
        let names = present(&READ, &self.state);
        self.engine.read(&names, &mut self.state)?;
        let solution = solve_state(&mut self.state, relaxation, self.step, began)?;
        let look = |r: &Record| Look { passes: passes + r.pass as u32, residual: r.residual, seconds: r.seconds };
        self.looks.extend(solution.history.iter().map(look));
        let names = present(&["spring", "trial", "trial_spin"], &self.state);
        self.engine.write(&names, &self.state)?;
        Ok(passes + solution.passes as u32)
    }
}
