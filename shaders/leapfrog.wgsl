// twin: src/laws/leapfrog.rs
// Explicit integration of a grain's translation: leapfrog with global damping, implicit at the half step.

/// Velocity from n - 1/2 to n + 1/2 (2.19), m/s.
fn advanced(motion: Motion, force: Vec) -> Vec {
    if (motion.inverse_mass == 0) {
        return motion.v;
    }
    let half = 0.5 * params.dt * params.damping;
    let acceleration = motion.inverse_mass * force + params.gravity;
    // Not ((1 - half) v + dt a) / (1 + half): that rounds a slow change of v as coarsely as v, and always the same way.
    return motion.v + (params.dt * acceleration - 2 * half * motion.v) / (1 + half);
}

/// Velocity from 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
fn kicked(motion: Motion, force: Vec) -> Vec {
    if (motion.inverse_mass == 0) {
        return motion.v;
    }
    let acceleration = motion.inverse_mass * force + params.gravity - params.damping * motion.v;
    return motion.v - 0.5 * params.dt * acceleration;
}

/// Velocity from n - 1/2 to n, m/s: the inverse of the kick.
fn at_step(motion: Motion, force: Vec) -> Vec {
    if (motion.inverse_mass == 0) {
        return motion.v;
    }
    let acceleration = motion.inverse_mass * force + params.gravity;
    return (motion.v + 0.5 * params.dt * acceleration) / (1 + 0.5 * params.dt * params.damping);
}
