// twin: src/body/rotation.rs
// Rotation slot: bodies with J1 = J2 = J3, for which the predictor-corrector (2.24)-(2.32) has a closed form and no
// orientation is needed. Owns spin and torque.

var<storage, read> spin: array<Spin>;            // N, rad/s, at the half step n - 1/2
var<storage, read_write> spin_next: array<Spin>; // N, rad/s
var<storage, read_write> torque: array<Spin>;    // N, N m, at step n; only where forces are asked for

var<storage, read_write> extrapolated_spin: array<Spin>;        // N, rad/s; contact dynamics: what a pass starts from
var<storage, read_write> pass_spin: array<Spin>;        // N, rad/s: after the last pass
var<storage, read_write> pass_spin_before: array<Spin>; // N, rad/s: after the pass before

/// 1/J.
fn inverse_inertia(position: Position, inverse_mass: Real) -> Real {
    return Real(INVERSE_GYRATION) * inverse_mass / (position.radius * position.radius);
}

/// Inverse inertia about a point of the surface, 1/(kg m²): 1/(J + m R²).
fn inverse_rolling_inertia(radius: Real, inverse_mass: Real) -> Real {
    // The constant is an f32, and so would be its quotient.
    return Real(INVERSE_GYRATION) / Real(1 + INVERSE_GYRATION) * inverse_mass / (radius * radius);
}

/// rad/s
fn spin_of(i: u32) -> Spin {
    return spin[i];
}

fn store_spin(i: u32, value: Spin) {
    spin_next[i] = value;
}

fn scale_next_spin(i: u32, factor: Real) {
    spin_next[i] = factor * spin_next[i];
}

fn store_torque(i: u32, value: Spin) {
    torque[i] = value;
}

/// Velocity of the surface point at the end of arm, relative to the centre, m/s.
fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return spin_velocity(spin, arm);
}

/// Change of ω from n - 1/2 to n + 1/2: (2.19) with the acceleration that the moment gives.
fn spin_change(w: Spin, acceleration: Spin) -> Spin {
    let half = 0.5 * params.dt * params.damping;
    return (params.dt * acceleration - 2 * half * w) / (1 + half);
}

/// From 0 to -1/2.
fn spin_change_back(w: Spin, acceleration: Spin) -> Spin {
    return -0.5 * params.dt * (acceleration - params.damping * w);
}

/// From n - 1/2 to n: the inverse of the kick.
fn spin_change_to_step(w: Spin, acceleration: Spin) -> Spin {
    let half = 0.5 * params.dt * params.damping;
    return (0.5 * params.dt * acceleration - half * w) / (1 + half);
}

/// Angular acceleration of a sphere, rad/s².
fn sphere_spin_acceleration(here: Body, torque: Spin) -> Spin {
    return inverse_inertia(here.position, here.velocity.inverse_mass) * torque;
}

/// n - 1/2 to n + 1/2.
fn sphere_spin_change(here: Body, torque: Spin) -> Spin {
    if (here.velocity.inverse_mass == 0) {
        return Spin();
    }
    return spin_change(here.spin, sphere_spin_acceleration(here, torque));
}

/// 0 to -1/2.
fn sphere_spin_change_back(here: Body, torque: Spin) -> Spin {
    if (here.velocity.inverse_mass == 0) {
        return Spin();
    }
    return spin_change_back(here.spin, sphere_spin_acceleration(here, torque));
}

/// n - 1/2 to n.
fn sphere_spin_change_to_step(here: Body, torque: Spin) -> Spin {
    if (here.velocity.inverse_mass == 0) {
        return Spin();
    }
    return spin_change_to_step(here.spin, sphere_spin_acceleration(here, torque));
}

/// Kinetic energy of a spin at step n, J.
fn spin_energy(here: Body, w: Spin) -> Real {
    if (here.velocity.inverse_mass == 0) {
        return 0;
    }
    return 0.5 * spin_squared(w) / inverse_inertia(here.position, here.velocity.inverse_mass);
}

fn extrapolated_spin_of(i: u32) -> Spin {
    return extrapolated_spin[i];
}

fn store_extrapolated_spin(i: u32, value: Spin) {
    extrapolated_spin[i] = value;
}

fn pass_spin_of(i: u32) -> Spin {
    return pass_spin[i];
}

fn store_pass_spin(i: u32, value: Spin) {
    pass_spin[i] = value;
}

fn pass_spin_before_of(i: u32) -> Spin {
    return pass_spin_before[i];
}

fn store_pass_spin_before(i: u32, value: Spin) {
    pass_spin_before[i] = value;
}
