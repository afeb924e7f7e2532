// twin: src/solve/momentum.rs
// How a relaxation goes on after a pass, in scenes and for problems from files. A pass leads from y to x⁺, and the next
// one sets out from y = x⁺ + beta (x⁺ - x) with beta of Nesterov (1983). Momentum begins anew when it carries the wrong
// way (O'Donoghue and Candès 2015), when the residual has risen, or when the curvature of W along the step shows that
// it was too long. Steps that are not too long for W may be for friction: passes then go in circles, and come no nearer
// in as many as it took to get there. (Sweeps of scenes have no such steps, and no sums `curvature` and
// `step_squared`.)

/// L is raised by so much more than what was seen of it, which comes from below.
const LIPSCHITZ_MARGIN = 1.02;
/// A residual has risen when it is this multiple of the least since it rose last.
const RISEN = 1.5;
/// Passes that may always go by without a smaller residual.
const PATIENCE = 100u;
/// The part of the tolerance below which velocities may change by rounding alone.
const ROUNDING = 0.1;
/// Larger than any residual.
const NONE_YET = 1e30;

/// The state of a relaxation.
struct SolverState {
    scale: Real,             // m/s: what residuals are relative to
    lipschitz_bound: Real,   // what no eigenvalue of the scaled W exceeds
    lipschitz: Real,         // the largest one known so far, L; a step is 1/L
    theta: Real,             // Nesterov's sequence
    beta: Real,              // momentum of the next pass
    residual_estimate: Real, // relative residual of the natural map that the last pass has met
    best: Real,              // the least one since the residual rose last
    lowest_residual: Real,   // the least one since steps were made shorter
    lowest_pass: u32,        // after so many passes
    step_divisor: Real,      // by this factor steps are shorter than W asks for
    residual: Real,          // of scenes, as last computed: largest residual of a contact relative to what acts on it
    resolved_residual: Real, // of scenes, as last computed: the same of what is beyond the rounding of loads
    residual_norm: Real,     // of scenes, as last computed: relative residual of the natural map
    coulomb_excess: Real,    // of scenes, as last computed: largest friction beyond its limit, over the largest push
    passes: u32,
    late_contacts: u32,      // of scenes: pairs found by the last residual to meet after all, counted from both sides
    step_too_long: u32,      // 1: the last step was too long for W, the next one is shorter; problems take it back
}

/// What a pass from y to x⁺ tells, after one that led to x: sums over contacts.
struct PassSums {
    residual_squared: Real,  // (m/s)², of the natural map
    restart_criterion: Real, // J, (y - x⁺)·(x⁺ - x), > 0 where momentum carries the wrong way
    curvature: Real,         // J, (x⁺ - y)·W (x⁺ - y)
    step_squared: Real,      // J, |x⁺ - y|² in the scales of the update
}

struct MomentumLimits {
    max_momentum: Real, // the largest beta: 0 for passes without momentum
    rounding: Real,     // relative residual below which the curvature of a pass may be rounding
}

/// Of a scene.
fn limits_of_scene(max_momentum: Real, tolerance: Real) -> MomentumLimits {
    return MomentumLimits(max_momentum, ROUNDING * tolerance);
}

/// The state before the first pass.
fn initial_state(scale: Real, lipschitz_bound: Real, lipschitz: Real) -> SolverState {
    var state = SolverState();
    state.scale = scale;
    state.lipschitz_bound = lipschitz_bound;
    state.lipschitz = max(lipschitz, Real(1));
    state.theta = 1;
    state.best = NONE_YET;
    state.lowest_residual = NONE_YET;
    state.step_divisor = 1;
    return state;
}

/// The step of a pass, as a fraction of the contacts' own scales.
fn step_of(state: SolverState) -> Real {
    return 1 / (state.step_divisor * state.lipschitz);
}

/// The state after a pass.
fn next_momentum(state: SolverState, sums: PassSums, limits: MomentumLimits) -> SolverState {
    var next = state;
    next.passes++;
    next.residual_estimate = sqrt(sums.residual_squared) / next.scale;
    // θ₊² = (1 - θ₊) θ²
    let theta = next.theta;
    let squared = theta * theta;
    next.theta = 0.5 * (theta * sqrt(squared + 4) - squared);
    next.beta = min(theta * (1 - theta) / (squared + next.theta), limits.max_momentum);
    // Shorter steps change velocities by less.
    let beyond_rounding = next.residual_estimate > limits.rounding * next.step_divisor;
    let short = sums.curvature > next.lipschitz * sums.step_squared && beyond_rounding;
    let risen = next.residual_estimate > RISEN * next.best;
    if (short) {
        let seen = LIPSCHITZ_MARGIN * sums.curvature / sums.step_squared;
        next.lipschitz = min(seen, max(next.lipschitz_bound, next.lipschitz));
    }
    next.step_too_long = u32(next.lipschitz > state.lipschitz);
    if (next.residual_estimate < next.lowest_residual) {
        next.lowest_residual = next.residual_estimate;
        next.lowest_pass = next.passes;
    }
    let circling = sums.step_squared > 0 && next.passes > 2 * next.lowest_pass + PATIENCE;
    if (circling) {
        next.step_divisor *= 2;
        next.lowest_residual = next.residual_estimate;
        next.lowest_pass = next.passes;
    }
    if (short || circling || risen || sums.restart_criterion > 0) {
        next.theta = 1;
        next.beta = 0;
    }
    next.best = select(min(next.best, next.residual_estimate), next.residual_estimate, short || risen);
    return next;
}
