//! One contact after the other, each solved exactly with all others as they are: in various orders, and colour by
//! colour with momentum.

use super::{
    contact::Contact,
    momentum::Momentum,
    operator::Operator,
    residual::contacts,
    solver::{Options, Solution, Watch},
};
use crate::error::{Error, Result};
use glam::DVec3;
use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use std::time::Instant;

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

/// Update the contacts of `order` one by one. The residual, each contact's share as it was before its update, and how
/// many updates found no solution.
fn sweep<O: Operator>(operator: &O, contacts: &[Contact], order: &[usize], r: &mut [DVec3]) -> (f64, usize) {
    let mut state = operator.state(r);
    let (mut sum, mut failures) = (0.0, 0);
    for &k in order {
        let contact = &contacts[k];
        let u = operator.velocity(&state, r, k);
        sum += contact.natural_map(r[k], u).length_squared();
        let (new, found) = contact.solve(contact.without(r[k], u), r[k]);
        failures += usize::from(!found);
        let change = new - r[k];
        if change != DVec3::ZERO {
            operator.add(&mut state, k, change);
            r[k] = new;
        }
    }
    (sum.sqrt() / operator.reference(), failures)
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
    let mut r = start;
    let mut pass = 0;
    let mut stop = watch.estimated(0, 0.0, &r);
    while !stop {
        pass += 1;
        match options.order {
            Order::RandomSweep => order.shuffle(&mut rng),
            Order::RandomSequential => order.fill_with(|| rng.random_range(0..n)),
            Order::ShuffledOnce | Order::Fixed => {}
        }
        let (estimate, failures) = sweep(operator, &contacts, &order, &mut r);
        watch.local_failures += failures;
        stop = watch.estimated(pass, estimate, &r);
    }
    watch.finish(&r)
}

/// Sweeps colour by colour from `start`, with momentum between them. Contacts of one colour do not see each other, so
/// the sweep could be done in parallel.
pub fn coloured<O: Operator>(operator: &O, start: Vec<DVec3>, options: &Options) -> Solution {
    let started = Instant::now();
    let contacts = contacts(operator);
    let mut watch = Watch::new(operator, &contacts, options, started);
    let colours = colours(operator);
    let mut order: Vec<usize> = (0..contacts.len()).collect();
    order.sort_by_key(|&k| colours[k]);
    let (mut x, mut y, mut next) = (start.clone(), start.clone(), start);
    let mut momentum = Momentum::default();
    let mut pass = 0;
    let mut stop = watch.estimated(0, 0.0, &x);
    while !stop {
        pass += 1;
        next.copy_from_slice(&y);
        let (estimate, failures) = sweep(operator, &contacts, &order, &mut next);
        watch.local_failures += failures;
        stop = watch.estimated(pass, estimate, &next);
        let uphill = (0..x.len()).map(|k| contacts[k].dot(y[k] - next[k], next[k] - x[k])).sum();
        let beta = momentum.next(uphill, estimate);
        for k in 0..x.len() {
            y[k] = next[k] + beta * (next[k] - x[k]);
        }
        std::mem::swap(&mut x, &mut next);
    }
    watch.finish(&x)
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
