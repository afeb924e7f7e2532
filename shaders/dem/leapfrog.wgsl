// twin: src/dem/leapfrog.rs
// Explicit integration of a grain's translation: leapfrog with global damping, implicit at the half step.

/// Change of the velocity from n - 1/2 to n + 1/2 (2.19), m/s.
fn velocity_change(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return Vec();
    }
    let half = 0.5 * params.dt * params.damping;
    let acceleration = velocity.inverse_mass * force + params.gravity;
    return with_flow(velocity.v, (params.dt * acceleration - 2 * half * velocity.v) / (1 + half));
}

/// A change of a velocity past the flow of the cell with what the way from faster to slower flow does to it: half of it at
/// the velocity before, half after.
fn with_flow(v: Vec, change: Vec) -> Vec {
    return past_next_flow(change, params.dt * (v + 0.5 * change));
}

/// From 0 to -1/2, m/s: without it the leapfrog loses an order of accuracy.
fn velocity_change_back(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return Vec();
    }
    let acceleration = velocity.inverse_mass * force + params.gravity - params.damping * velocity.v;
    return -0.5 * params.dt * past_flow(acceleration, velocity.v);
}

/// From n - 1/2 to n, m/s: the inverse of the kick.
fn velocity_change_to_step(velocity: Velocity, force: Vec) -> Vec {
    if (velocity.inverse_mass == 0) {
        return Vec();
    }
    let half = 0.5 * params.dt * params.damping;
    let acceleration = velocity.inverse_mass * force + params.gravity;
    let change = (0.5 * params.dt * acceleration - half * velocity.v) / (1 + half);
    return past_flow(change, 0.5 * params.dt * (velocity.v + change));
}

/// What contacts do to grain i moves it by a step. Whether this has to be the last one, as `commit_position` says.
fn leap(i: u32, here: Body, forces: BodyForces) -> bool {
    let spin_change = sphere_spin_change(here, forces.sum.torque);
    let v = change_velocities(i, here, velocity_change(here.velocity, forces.sum.force), spin_change);
    let point = wrap(displaced(here.position.x, here.low.x, params.dt * carried(here.position.x, v)));
    let stride = approach(params.dt * sqrt(dot(v, v)), here.position.radius);
    return commit_position(i, here.position, here.low, point, stride, forces.crossed);
}
