//! Twin of `shaders/solve/momentum.wgsl`: how a relaxation goes on after a pass, in scenes and for problems from files.
//!
//! A pass leads from y to x⁺, and the next one sets out from `y = x⁺ + β (x⁺ − x)` with β of Nesterov (1983), θ from 1.
//! Information about a force travels one contact per pass, and without momentum it diffuses: a stack of N grains takes
//! of the order of N² passes; with momentum it takes of the order of N.
//!
//! Momentum begins anew (θ = 1, β = 0)
//! - when it carries the wrong way: the gradient restart of O'Donoghue and Candès (2015);
//! - when the residual has risen, a stall that comes with μ ≥ 0.3 on dense beds and that the gradient does not show;
//! - when the curvature of W along the step shows that it was too long: then L is raised (backtracking of Beck and
//!   Teboulle 2009);
//! - when passes come no nearer in as many as it took to get there. Steps that are not too long for W may be for
//!   friction, so that passes go in circles: then steps are halved. (Sweeps have no curvature: their L is 1. Those of scenes
//!   keep their steps.)

use crate::record::record;

/// L is raised by so much more than what was seen of it, which comes from below.
pub const LIPSCHITZ_MARGIN: f64 = 1.02;
/// A residual has risen when it is this multiple of the least since it rose last.
const RISEN: f64 = 1.5;
/// Passes that may always go by without a smaller residual.
const PATIENCE: u32 = 100;
/// The part of the tolerance below which velocities may change by rounding alone.
const ROUNDING: f64 = 0.1;
/// Relative residuals of problems below which the curvature of a pass is the rounding of double and of single
/// precision, whatever the tolerance.
pub const ROUNDING_DOUBLE: f64 = 1e-10;
pub const ROUNDING_SINGLE: f64 = 1e-5;
/// Larger than any residual.
pub const NONE_YET: f64 = 1e30;
/// Passes of the power iteration for the largest eigenvalue of W.
pub const POWER_ITERATIONS: u32 = 40;

record!(
    /// The state of a relaxation.
    SolverState {
        /// m/s: what residuals are relative to.
        scale: f64 [Velocity],
        /// What no eigenvalue of the scaled W exceeds, and the largest one known so far, L; a step is 1/L.
        lipschitz_bound: f64,
        lipschitz: f64,
        /// Nesterov's sequence, and the momentum of the next pass.
        theta: f64,
        beta: f64,
        /// Relative residual of the natural map that the last pass has met.
        residual_estimate: f64,
        /// The least one since the residual rose last.
        best: f64,
        /// The least one since steps were made shorter, after so many passes.
        lowest_residual: f64,
        lowest_pass: u32,
        /// By this factor steps are shorter than W asks for.
        step_divisor: f64,
        /// Of scenes, as last computed: the largest residual of a contact relative to what acts on it, the same of
        /// what is beyond the rounding of loads, the relative residual of the natural map, and the largest friction
        /// beyond the Coulomb limit over the largest normal impulse.
        residual: f64,
        resolved_residual: f64,
        residual_norm: f64,
        coulomb_excess: f64,
        passes: u32,
        /// Of scenes: pairs found by the last residual to meet after all, counted from both sides.
        late_contacts: u32,
        /// 1: the last step was too long for W, and the next one will be shorter. Problems take it back; scenes go on
        /// from it, because their warm velocities belong to it.
        step_too_long: u32,
    }
);

impl SolverState {
    /// Before the first pass.
    pub fn new(scale: f64, lipschitz_bound: f64, lipschitz: f64) -> SolverState {
        SolverState {
            scale,
            lipschitz_bound,
            lipschitz: lipschitz.max(1.0),
            theta: 1.0,
            best: NONE_YET,
            lowest_residual: NONE_YET,
            step_divisor: 1.0,
            ..SolverState::default()
        }
    }

    /// The step of a pass, as a fraction of the contacts' own scales.
    pub fn step(&self) -> f64 {
        1.0 / (self.step_divisor * self.lipschitz)
    }
}

/// What a pass from y to x⁺ tells, after one that led to x: sums over contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassSums {
    /// (m/s)², of the natural map.
    pub residual_squared: f64,
    /// J, `(y − x⁺)·(x⁺ − x)`, > 0 where momentum carries the wrong way.
    pub restart_criterion: f64,
    /// J, `(x⁺ − y)·W (x⁺ − y)`.
    pub curvature: f64,
    /// J, `‖x⁺ − y‖²` in the scales of the update.
    pub step_squared: f64,
}

impl PassSums {
    /// Of updates in place, which have no curvature, and steps of a length that nobody asks for but that is not zero.
    pub fn of_sweep() -> PassSums {
        PassSums { step_squared: 1.0, ..PassSums::default() }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MomentumLimits {
    /// The largest β: 0 for passes without momentum.
    pub max_momentum: f64,
    /// Relative residual below which the curvature of a pass may be rounding.
    pub rounding: f64,
}

impl MomentumLimits {
    /// Of a scene. It goes on from a step that was too long, so that rounding taken for curvature costs it a restart
    /// and shorter steps at most. With the floor of problems a scene with a tolerance of 1e-5 in single precision would
    /// no longer see that its steps are too long before it is solved.
    pub fn of_scene(max_momentum: f64, tolerance: f64) -> MomentumLimits {
        MomentumLimits { max_momentum, rounding: ROUNDING * tolerance }
    }

    /// Of a problem. It takes a step back that was too long, which rounding must not make it do again and again: hence
    /// the floor, that of the precision.
    pub fn of_problem(accelerated: bool, tolerance: f64, floor: f64) -> MomentumLimits {
        let scene = MomentumLimits::of_scene(f64::from(u8::from(accelerated)), tolerance);
        MomentumLimits { rounding: scene.rounding.max(floor), ..scene }
    }
}

/// The state after a pass.
pub fn next_momentum(state: &SolverState, sums: &PassSums, limits: &MomentumLimits) -> SolverState {
    let mut next = *state;
    next.passes += 1;
    next.residual_estimate = sums.residual_squared.sqrt() / next.scale;
    // θ₊² = (1 − θ₊) θ²
    let theta = next.theta;
    let squared = theta * theta;
    next.theta = 0.5 * (theta * (squared + 4.0).sqrt() - squared);
    next.beta = (theta * (1.0 - theta) / (squared + next.theta)).min(limits.max_momentum);
    // Shorter steps change velocities by less.
    let beyond_rounding = next.residual_estimate > limits.rounding * next.step_divisor;
    let short = sums.curvature > next.lipschitz * sums.step_squared && beyond_rounding;
    let risen = next.residual_estimate > RISEN * next.best;
    if short {
        let seen = LIPSCHITZ_MARGIN * sums.curvature / sums.step_squared;
        next.lipschitz = seen.min(next.lipschitz_bound.max(next.lipschitz));
    }
    next.step_too_long = u32::from(next.lipschitz > state.lipschitz);
    if next.residual_estimate < next.lowest_residual {
        (next.lowest_residual, next.lowest_pass) = (next.residual_estimate, next.passes);
    }
    let circling = sums.step_squared > 0.0 && next.passes > 2 * next.lowest_pass + PATIENCE;
    if circling {
        next.step_divisor *= 2.0;
        (next.lowest_residual, next.lowest_pass) = (next.residual_estimate, next.passes);
    }
    if short || circling || risen || sums.restart_criterion > 0.0 {
        (next.theta, next.beta) = (1.0, 0.0);
    }
    next.best = if short || risen { next.residual_estimate } else { next.best.min(next.residual_estimate) };
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: MomentumLimits = MomentumLimits { max_momentum: 1.0, rounding: 1e-5 };

    /// A state after so many good passes.
    fn after(passes: u32) -> SolverState {
        let sums = |k: u32| PassSums { residual_squared: 0.9f64.powi(k as i32), ..PassSums::default() };
        (0..passes).fold(SolverState::new(1.0, 10.0, 2.0), |state, k| next_momentum(&state, &sums(k), &LIMITS))
    }

    #[test]
    fn momentum_follows_nesterov() {
        // θ₊² = (1 − θ₊) θ² from θ = 1: the golden ratio first; β is 0 at first and tends to 1.
        assert_eq!(after(1).beta, 0.0);
        assert!((after(1).theta - (5f64.sqrt() - 1.0) / 2.0).abs() < 1e-15);
        let (one, many) = (after(2), after(100));
        assert!((one.beta - 0.28175352512532087).abs() < 1e-12, "{}", one.beta);
        assert!(many.beta > 0.96 && many.beta < 1.0, "{}", many.beta);
        let none = MomentumLimits { max_momentum: 0.0, ..LIMITS };
        assert_eq!(next_momentum(&many, &PassSums::default(), &none).beta, 0.0);
    }

    #[test]
    fn what_ends_momentum() {
        let state = after(20);
        let good = PassSums { residual_squared: state.best * state.best, ..PassSums::default() };
        assert!(next_momentum(&state, &good, &LIMITS).beta > 0.5);
        let restarted = |sums: PassSums| {
            let next = next_momentum(&state, &sums, &LIMITS);
            assert_eq!((next.beta, next.theta), (0.0, 1.0), "{sums:?}");
            next
        };
        restarted(PassSums { restart_criterion: 1e-9, ..good });
        let risen = restarted(PassSums { residual_squared: 2.3 * good.residual_squared, ..good });
        assert_eq!((risen.best, risen.step_too_long), (risen.residual_estimate, 0));
        let long = restarted(PassSums { curvature: 3.0, step_squared: 1.0, ..good });
        assert_eq!((long.lipschitz, long.step_too_long), (LIPSCHITZ_MARGIN * 3.0, 1));
        let bounded = restarted(PassSums { curvature: 30.0, step_squared: 1.0, ..good });
        assert_eq!((bounded.lipschitz, bounded.step_too_long), (10.0, 1));
        let rounding = PassSums { residual_squared: 1e-12, curvature: 3.0, step_squared: 1.0, ..good };
        assert_eq!(next_momentum(&state, &rounding, &LIMITS).lipschitz, 2.0);
    }

    #[test]
    fn circles_halve_the_steps() {
        let mut state = after(20);
        let sums = PassSums { residual_squared: state.best * state.best, step_squared: 1.0, ..PassSums::default() };
        while state.step_divisor == 1.0 {
            state = next_momentum(&state, &sums, &LIMITS);
        }
        assert_eq!((state.passes, state.beta, state.step()), (2 * 20 + PATIENCE + 1, 0.0, 0.25));
        let settled = PassSums { step_squared: 0.0, ..sums };
        let state = (0..1000).fold(after(20), |state, _| next_momentum(&state, &settled, &LIMITS));
        assert_eq!(state.step_divisor, 1.0);
    }
}
