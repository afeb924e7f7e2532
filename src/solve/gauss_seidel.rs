//! One contact after the other with all others as they are: each solved exactly, in various orders, or colour by colour
//! by the disc update of scenes, with momentum. Sweeps by colours may go in circles; then steps are halved, and if that
//! does not help, Jacobi's passes go on from the best iterate.

use crate::solve::{
    contact::Contact,
    jacobi,
    momentum::{MomentumLimits, PassSums, SolverState, next_momentum},
    natural_map::disc_update,
    operator::Operator,
    options::{Options, Order},
    residual::{contacts, measured},
    solution::{Monitor, Solution},
};
use glam::DVec3;
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// Sweeps after which velocities are computed anew from the impulses.
const REFRESH: u32 = 64;

/// Updates of a contact whenever a sweep by colours comes to it. The first one solves spheres exactly, as in scenes;
/// blocks of files, which join normal and tangent, leave something to a second one, which costs no pass.
const UPDATES: usize = 2;

/// Steps of sweeps by colours that are shorter than one over this do not end circles either.
const MOST_HALVED: f64 = 2.0;

/// Contacts with their impulses and the state that belongs to them.
struct Sweep<'a, O: Operator> {
    operator: &'a O,
    contacts: &'a [Contact],
    r: Vec<DVec3>,
    state: O::State,
}

impl<O: Operator> Sweep<'_, O> {
    /// Give the contacts of `order` one by one the impulse that `update` makes of contact, impulse and velocity.
    fn run(&mut self, order: &[usize], mut update: impl FnMut(&Contact, DVec3, DVec3) -> DVec3) {
        for &k in order {
            let u = self.operator.velocity(&self.state, k);
            let new = update(&self.contacts[k], self.r[k], u);
            let change = new - self.r[k];
            if change != DVec3::ZERO {
                self.operator.add(&mut self.state, k, change);
                self.r[k] = new;
            }
        }
    }

    /// Free the state from the round-off that sweeps leave in it.
    fn refresh(&mut self) {
        self.operator.set(&mut self.state, &self.r);
    }

    /// The velocities are known, so this is no pass.
    fn residual(&self) -> f64 {
        let u: Vec<DVec3> = (0..self.r.len()).map(|k| self.operator.velocity(&self.state, k)).collect();
        measured(self.operator, self.contacts, &self.r, &u)
    }
}

/// Gauss-Seidel from `start`, in the order of the options.
pub fn solve<O: Operator>(operator: &O, start: Vec<DVec3>, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut monitor = Monitor::new(operator, &contacts, options, started);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let n = contacts.len();
    let mut order: Vec<usize> = (0..n).collect();
    if options.order == Order::ShuffledOnce {
        order.shuffle(&mut rng);
    }
    let mut sweep = Sweep { operator, contacts: &contacts, r: start, state: operator.free() };
    let mut pass = 0_u32;
    loop {
        if pass.is_multiple_of(REFRESH) {
            monitor.other_passes += 1;
            sweep.refresh();
        }
        if monitor.stop(pass as usize, sweep.residual(), &sweep.r) {
            return monitor.finish();
        }
        pass += 1;
        match options.order {
            Order::RandomSweep => order.shuffle(&mut rng),
            Order::RandomSequential => order.fill_with(|| rng.random_range(0..n)),
            Order::ShuffledOnce | Order::Fixed => {}
        }
        sweep.run(&order, |contact, r, u| {
            let (new, found) = contact.solve(contact.without(r, u), r);
            monitor.local_failures += usize::from(!found);
            new
        });
    }
}

/// Sweeps colour by colour from `start`, with momentum between them. Contacts of one colour do not see each other, so
/// that they could be updated all at once.
pub fn colored<O: Operator>(operator: &O, start: Vec<DVec3>, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut monitor = Monitor::new(operator, &contacts, options, started);
    let colors = colors(operator);
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by_key(|&k| colors[k]);
    let mut sweep = Sweep { operator, contacts: &contacts, r: start, state: operator.free() };
    sweep.refresh();
    monitor.other_passes += 1;
    // The iterate before, and where the sweep began.
    let (mut x, mut y) = (sweep.r.clone(), sweep.r.clone());
    let (mut state_x, mut newer) = (sweep.state.clone(), sweep.state.clone());
    let mut momentum = SolverState::new(operator.reference(), 0.0, 1.0);
    let limits = MomentumLimits { max_momentum: 1.0, rounding: 0.0 };
    let mut stop = monitor.stop(0, sweep.residual(), &sweep.r);
    while !stop {
        y.copy_from_slice(&sweep.r);
        sweep.run(&order, |contact, r, u| {
            let b = contact.without(r, u);
            (0..UPDATES).fold(r, |r, _| disc_update(&contact.at(contact.with(r, b)), r, momentum.step()))
        });
        let mut sums = PassSums::of_sweep();
        for (k, contact) in contacts.iter().enumerate() {
            let (u, u_x) = (operator.velocity(&sweep.state, k), operator.velocity(&state_x, k));
            sums.residual_squared += contact.natural_map(sweep.r[k], u).length_squared();
            // (y − x⁺)·W (x⁺ − x): in place the metric is W.
            sums.restart_criterion += (y[k] - sweep.r[k]).dot(u - u_x);
        }
        momentum = next_momentum(&momentum, &sums, &limits);
        stop = monitor.stop(momentum.passes as usize, momentum.residual_estimate, &sweep.r);
        if !stop && momentum.step_divisor > MOST_HALVED {
            return jacobi::relax(operator, &contacts, monitor.best(), true, options, monitor);
        }

        let beta = momentum.beta;
        for (x, r) in x.iter_mut().zip(&mut sweep.r) {
            let older = std::mem::replace(x, *r);
            *r += beta * (*r - older);
        }
        newer.clone_from(&sweep.state);
        operator.extrapolate(&mut sweep.state, &newer, &state_x, beta);
        std::mem::swap(&mut state_x, &mut newer);
        if momentum.passes.is_multiple_of(REFRESH) {
            monitor.other_passes += 2;
            operator.set(&mut state_x, &x);
            sweep.refresh();
        }
    }
    monitor.finish()
}

/// The smallest colour that no neighbour has, contact by contact: at most one more colour than the largest number of
/// neighbours, and no contact without.
pub fn colors<O: Operator>(operator: &O) -> Vec<usize> {
    let mut colors = vec![usize::MAX; operator.len()];
    let mut taken = Vec::new();
    for k in 0..operator.len() {
        taken.clear();
        taken.extend(operator.neighbours(k).filter(|&j| j != k).map(|j| colors[j]));
        taken.sort_unstable();
        taken.dedup();
        colors[k] = taken.iter().enumerate().find(|&(c, &used)| c != used).map_or(taken.len(), |(c, _)| c);
    }
    colors
}
