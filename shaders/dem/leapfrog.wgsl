// twin: src/dem/leapfrog.rs
// Explicit integration of a grain's translation: leapfrog with global damping, implicit at the half step.

/// Velocity from n - 1/2 to n + 1/2 (2.19), m/s.
fn integrate_velocity(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return velocity.v;
    }
    let half = 0.5 * params.dt * params.damping;
    let acceleration = velocity.inverse_mass * force + params.gravity;
    // Not ((1 - half) v + dt a) / (1 + half): that rounds a slow change of v as coarsely as v, and always the same way.
    return velocity.v + (params.dt * acceleration - 2 * half * velocity.v) / (1 + half);
}

/// Velocity from 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
fn half_kick_velocity(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return velocity.v;
    }
    let acceleration = velocity.inverse_mass * force + params.gravity - params.damping * velocity.v;
    return velocity.v - 0.5 * params.dt * acceleration;
}

/// Velocity from n - 1/2 to n, m/s: the inverse of the kick.
fn velocity_at_step(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return velocity.v;
    }
    let acceleration = velocity.inverse_mass * force + params.gravity;
    return (velocity.v + 0.5 * params.dt * acceleration) / (1 + 0.5 * params.dt * params.damping);
}
