//! What solvers return, and the monitor that none of the iterations escapes: what is returned is the best iterate there
//! was, with the residual it has.

use crate::solve::{
    contact::Contact,
    operator::{Operator, velocities},
    options::Options,
    residual,
};
use glam::DVec3;
use std::time::Instant;

/// An iterate whose residual is this much larger than the best one is not on its way to a solution.
pub const DIVERGED: f64 = 1e6;

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

/// Keeps the best iterate, the history and the clock, and says when to stop.
pub struct Monitor<'a, O: Operator> {
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

impl<'a, O: Operator> Monitor<'a, O> {
    pub fn new(operator: &'a O, contacts: &'a [Contact], options: &'a Options, started: Instant) -> Monitor<'a, O> {
        Monitor {
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

    /// Passes so far.
    pub fn passes(&self) -> usize {
        self.passes
    }

    /// The best iterate so far.
    pub fn best(&self) -> Vec<DVec3> {
        self.best.clone()
    }

    /// By one more pass, without whatever round-off the caller's velocities have gathered.
    fn exact(&mut self, r: &[DVec3]) -> f64 {
        self.other_passes += 1;
        velocities(self.operator, &mut self.state, r, &mut self.u);
        residual::measured(self.operator, self.contacts, r, &self.u)
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
        !going || pass >= self.options.max_iterations || (self.options.interrupted)()
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
