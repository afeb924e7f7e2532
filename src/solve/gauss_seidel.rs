//! One contact after the other, each solved exactly with all others as they are: in various orders, and colour by
//! colour with momentum.

use crate::error::{Error, Result};
use crate::solve::{
    contact::Contact,
    momentum::Momentum,
    operator::Operator,
    residual::contacts,
    solver::{Options, Solution, Watch},
};
use glam::DVec3;
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

/// Sweeps after which velocities are computed anew from the impulses.
const REFRESH: usize = 64;

/// The order of the contacts in a sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Order {
    /// Each once, in a fresh order every sweep.
    RandomSweep,
    /// As many as there are, drawn with replacement.
    RandomSequential,
    /// Each once, in a random order that all sweeps share.
    ShuffledOnce,
    /// Each once, as they are numbered.
    #[default]
    Fixed,
}

impl Order {
    pub const ALL: [Order; 4] = [Order::RandomSweep, Order::RandomSequential, Order::ShuffledOnce, Order::Fixed];

    pub fn label(self) -> &'static str {
        match self {
            Order::RandomSweep => "random-sweep",
            Order::RandomSequential => "random-sequential",
            Order::ShuffledOnce => "shuffled-once",
            Order::Fixed => "fixed",
        }
    }
}

impl std::str::FromStr for Order {
    type Err = Error;

    fn from_str(name: &str) -> Result<Order> {
        let all = Order::ALL.map(Order::label).join(", ");
        let found = Order::ALL.into_iter().find(|order| order.label() == name);
        found.ok_or_else(|| Error::Problem(format!("order = \"{name}\" must be one of {all}")))
    }
}

/// Contacts with their impulses and the state that belongs to them.
struct Sweep<'a, O: Operator> {
    operator: &'a O,
    contacts: &'a [Contact],
    r: Vec<DVec3>,
    state: O::State,
}

impl<O: Operator> Sweep<'_, O> {
    /// Update the contacts of `order` one by one. How many updates found no solution.
    fn run(&mut self, order: &[usize]) -> usize {
        let mut failures = 0;
        for &k in order {
            let u = self.operator.velocity(&self.state, k);
            let (new, found) = self.contacts[k].solve(self.contacts[k].without(self.r[k], u), self.r[k]);
            failures += usize::from(!found);
            let change = new - self.r[k];
            if change != DVec3::ZERO {
                self.operator.add(&mut self.state, k, change);
                self.r[k] = new;
            }
        }
        failures
    }

    /// Free the state from the round-off that sweeps leave in it.
    fn refresh(&mut self) {
        self.operator.set(&mut self.state, &self.r);
    }

    /// Relative to the reference. The velocities are known, so this is no pass.
    fn residual(&self) -> f64 {
        let part = |k: usize| self.contacts[k].natural_map(self.r[k], self.operator.velocity(&self.state, k));
        let sum: f64 = (0..self.r.len()).map(|k| part(k).length_squared()).sum();
        sum.sqrt() / self.operator.reference()
    }
}

/// Gauss-Seidel from `start`, in the order of the options.
pub fn solve<O: Operator>(operator: &O, start: Vec<DVec3>, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut watch = Watch::new(operator, &contacts, options, started);
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    let n = contacts.len();
    let mut order: Vec<usize> = (0..n).collect();
    if options.order == Order::ShuffledOnce {
        order.shuffle(&mut rng);
    }
    let mut sweep = Sweep { operator, contacts: &contacts, r: start, state: operator.free() };
    let mut pass = 0;
    loop {
        if pass % REFRESH == 0 {
            watch.other_passes += 1;
            sweep.refresh();
        }
        if watch.stop(pass, sweep.residual(), &sweep.r) {
            return watch.finish();
        }
        pass += 1;
        match options.order {
            Order::RandomSweep => order.shuffle(&mut rng),
            Order::RandomSequential => order.fill_with(|| rng.random_range(0..n)),
            Order::ShuffledOnce | Order::Fixed => {}
        }
        watch.local_failures += sweep.run(&order);
    }
}

/// Sweeps colour by colour from `start`, with momentum between them. Contacts of one colour do not see each other, so
/// that they could be updated all at once.
pub fn coloured<O: Operator>(operator: &O, start: Vec<DVec3>, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut watch = Watch::new(operator, &contacts, options, started);
    let colours = colours(operator);
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by_key(|&k| colours[k]);
    let mut sweep = Sweep { operator, contacts: &contacts, r: start, state: operator.free() };
    sweep.refresh();
    watch.other_passes += 1;
    // The iterate before, and where the sweep began.
    let (mut x, mut y) = (sweep.r.clone(), sweep.r.clone());
    let (mut state_x, mut newer) = (sweep.state.clone(), sweep.state.clone());
    let mut momentum = Momentum::default();
    let mut pass = 0;
    let mut stop = watch.stop(0, sweep.residual(), &sweep.r);
    while !stop {
        pass += 1;
        y.copy_from_slice(&sweep.r);
        watch.local_failures += sweep.run(&order);
        let residual = sweep.residual();
        stop = watch.stop(pass, residual, &sweep.r);

        let uphill = (0..x.len()).map(|k| contacts[k].dot(y[k] - sweep.r[k], sweep.r[k] - x[k])).sum();
        let beta = momentum.next(uphill, residual);
        for (x, r) in x.iter_mut().zip(&mut sweep.r) {
            let older = std::mem::replace(x, *r);
            *r += beta * (*r - older);
        }
        newer.clone_from(&sweep.state);
        operator.extrapolate(&mut sweep.state, &newer, &state_x, beta);
        std::mem::swap(&mut state_x, &mut newer);
        if pass % REFRESH == 0 {
            watch.other_passes += 2;
            operator.set(&mut state_x, &x);
            sweep.refresh();
        }
    }
    watch.finish()
}

/// The smallest colour that no neighbour has, contact by contact: at most one more colour than the largest number of
/// neighbours, and no contact without.
pub fn colours<O: Operator>(operator: &O) -> Vec<usize> {
    let mut colours = vec![usize::MAX; operator.len()];
    let mut taken = Vec::new();
    for k in 0..operator.len() {
        taken.clear();
        taken.extend(operator.neighbours(k).filter(|&j| j != k).map(|j| colours[j]));
        taken.sort_unstable();
        taken.dedup();
        colours[k] = taken.iter().enumerate().find(|&(c, &used)| c != used).map_or(taken.len(), |(c, _)| c);
    }
    colours
}
