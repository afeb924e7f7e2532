//! One interface for all solvers, and the watch that none of them escapes: what is returned is the best iterate there
//! was, with the residual it has.

#[cfg(feature = "socp")]
use super::socp;
use super::{
    contact::Contact,
    gauss_seidel::{self, Order},
    jacobi, lemke,
    operator::{Operator, velocities},
    problem::Problem,
    residual,
};
use crate::error::{Error, Result};
use glam::DVec3;
use std::time::Instant;

/// An iterate whose residual is this much larger than the best one is not on its way to a solution.
pub(super) const DIVERGED: f64 = 1e6;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// The single-contact update swept over all contacts.
    GaussSeidel,
    /// All contacts from the same iterate, with a step that cannot diverge.
    Jacobi,
    /// The same with momentum and two tests for its restart.
    JacobiAccelerated,
    /// Gauss-Seidel colour by colour with that momentum.
    ColouredAccelerated,
    /// Cone programs with De Saxcé's correction as a fixed point.
    Socp,
    /// Complementary pivoting; exact, for small problems in the plane.
    Lemke,
}

impl Solver {
    pub const ALL: [Solver; 6] = [
        Solver::GaussSeidel,
        Solver::Jacobi,
        Solver::JacobiAccelerated,
        Solver::ColouredAccelerated,
        Solver::Socp,
        Solver::Lemke,
    ];

    pub fn label(self) -> &'static str {
        match self {
            Solver::GaussSeidel => "gauss-seidel",
            Solver::Jacobi => "jacobi",
            Solver::JacobiAccelerated => "jacobi-accelerated",
            Solver::ColouredAccelerated => "coloured-accelerated",
            Solver::Socp => "socp",
            Solver::Lemke => "lemke",
        }
    }

    /// Whether this build has it.
    ///
    /// # Errors
    /// [`Error::Problem`] with the cargo feature that is missing.
    pub fn check_built(self) -> Result<()> {
        match self {
            Solver::Socp if cfg!(not(feature = "socp")) => Err(Error::Problem(
                "packstone was built without the cargo feature `socp`, which the solver needs".into(),
            )),
            _ => Ok(()),
        }
    }
}

impl std::str::FromStr for Solver {
    type Err = Error;

    fn from_str(name: &str) -> Result<Solver> {
        let all = Solver::ALL.map(Solver::label).join(", ");
        let found = Solver::ALL.into_iter().find(|solver| solver.label() == name);
        found.ok_or_else(|| Error::Problem(format!("solver = \"{name}\" must be one of {all}")))
    }
}

#[derive(Clone, Debug)]
pub struct Options {
    /// Relative residual to reach, see [`residual::residual`].
    pub tolerance: f64,
    /// Passes at most; for `socp` cone programs, for `lemke` pivots.
    pub max_iterations: usize,
    /// Of `gauss-seidel`.
    pub order: Order,
    /// Of the random orders.
    pub seed: u64,
    /// Solve the associated (convex, dilatant) problem: `K* ∋ u ⟂ r ∈ K_μ` without De Saxcé's term. Only `socp` does.
    pub associated: bool,
}

impl Default for Options {
    fn default() -> Options {
        Options { tolerance: 1e-4, max_iterations: 10_000, order: Order::default(), seed: 1, associated: false }
    }
}

impl Options {
    pub(super) fn check(&self, solver: Solver) -> Result<()> {
        solver.check_built()?;
        if !(self.tolerance > 0.0 && self.tolerance.is_finite()) {
            return Err(Error::Problem(format!("tolerance = {} must be finite and positive", self.tolerance)));
        }
        if self.associated && solver != Solver::Socp {
            let solver = solver.label();
            return Err(Error::Problem(format!("{solver} cannot solve the associated problem, but socp can")));
        }
        Ok(())
    }
}

/// A row of the history.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Record {
    pub pass: usize,
    pub residual: f64,
    /// Since the start, of the wall clock.
    pub seconds: f64,
}

#[derive(Clone, Debug, Default)]
pub struct Solution {
    /// Impulses and velocities of the contacts, `u = W r + q`.
    pub r: Vec<DVec3>,
    pub u: Vec<DVec3>,
    /// Applications of W by the iteration; for `socp` steps of the interior point method, for `lemke` pivots.
    pub passes: usize,
    /// Applications of W besides: to find the step, to free velocities from round-off, to confirm the residual.
    pub other_passes: usize,
    /// See [`residual::residual`]; that of the associated problem if this is what was asked for.
    pub residual: f64,
    pub converged: bool,
    /// Updates of single contacts for which no solution was found; each left a force within its cone.
    pub local_failures: usize,
    pub history: Vec<Record>,
}

/// Solve from r = 0.
///
/// # Errors
/// [`Error::Problem`] where the solver is not made for the problem. Not to converge is no error.
pub fn solve(problem: &Problem, solver: Solver, options: &Options) -> Result<Solution> {
    options.check(solver)?;
    let start = vec![DVec3::ZERO; problem.len()];
    match solver {
        Solver::GaussSeidel => Ok(gauss_seidel::solve(problem, start, options)),
        Solver::Jacobi => Ok(jacobi::solve(problem, start, false, options)),
        Solver::JacobiAccelerated => Ok(jacobi::solve(problem, start, true, options)),
        Solver::ColouredAccelerated => Ok(gauss_seidel::coloured(problem, start, options)),
        #[cfg(feature = "socp")]
        Solver::Socp => Ok(socp::solve(problem, options)),
        #[cfg(not(feature = "socp"))]
        Solver::Socp => unreachable!("check_built has refused it"),
        Solver::Lemke => lemke::solve(problem, options),
    }
}

/// Keeps the best iterate, the history and the clock, and says when to stop.
pub(super) struct Watch<'a, O: Operator> {
    operator: &'a O,
    contacts: &'a [Contact],
    options: &'a Options,
    started: Instant,
    history: Vec<Record>,
    best: Vec<DVec3>,
    best_residual: f64,
    passes: usize,
    state: O::State,
    u: Vec<DVec3>,
    pub other_passes: usize,
    pub local_failures: usize,
}

impl<'a, O: Operator> Watch<'a, O> {
    pub fn new(operator: &'a O, contacts: &'a [Contact], options: &'a Options, started: Instant) -> Watch<'a, O> {
        Watch {
            operator,
            contacts,
            options,
            started,
            history: Vec::new(),
            best: vec![DVec3::ZERO; contacts.len()],
            best_residual: f64::INFINITY,
            passes: 0,
            state: operator.free(),
            u: vec![DVec3::ZERO; contacts.len()],
            other_passes: 0,
            local_failures: 0,
        }
    }

    /// By one more pass, without whatever round-off the caller's velocities have gathered.
    fn exact(&mut self, r: &[DVec3]) -> f64 {
        self.other_passes += 1;
        velocities(self.operator, &mut self.state, r, &mut self.u);
        residual::relative(self.contacts, r, &self.u, self.operator.reference())
    }

    /// After a pass that led to `r`: whether to stop.
    pub fn stop(&mut self, pass: usize, mut residual: f64, r: &[DVec3]) -> bool {
        if residual <= self.options.tolerance {
            residual = self.exact(r);
        }
        let seconds = self.started.elapsed().as_secs_f64();
        self.history.push(Record { pass, residual, seconds });
        self.passes = pass;
        if residual < self.best_residual {
            self.best_residual = residual;
            self.best.copy_from_slice(r);
        }
        // Written so that NaN stops.
        let going = residual > self.options.tolerance && residual <= DIVERGED * self.best_residual;
        !going || pass >= self.options.max_iterations
    }

    /// The best iterate and what is to be said about it.
    pub fn finish(mut self) -> Solution {
        let r = std::mem::take(&mut self.best);
        let residual = self.exact(&r);
        Solution {
            converged: residual <= self.options.tolerance,
            r,
            u: self.u,
            passes: self.passes,
            other_passes: self.other_passes,
            residual,
            local_failures: self.local_failures,
            history: self.history,
        }
    }
}
