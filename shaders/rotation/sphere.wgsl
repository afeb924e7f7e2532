// twin: src/laws/rotation.rs
// Rotation slot: bodies with J1 = J2 = J3, for which the predictor-corrector (2.24)-(2.32) has a closed form and no
// orientation is needed. Owns spin and torque.

var<storage, read> spin: array<Spin>;            // N, rad/s, at the half step n - 1/2
var<storage, read_write> spin_next: array<Spin>; // N, rad/s
var<storage, read_write> torque: array<Spin>;    // N, N m, at step n; only where forces are asked for

var<storage, read_write> ahead_spin: array<Spin>;        // N, rad/s; contact dynamics: what a pass starts from
var<storage, read_write> trial_spin: array<Spin>;        // N, rad/s: after the last pass
var<storage, read_write> trial_spin_before: array<Spin>; // N, rad/s: after the pass before

/// 1/J.
fn inverse_inertia(place: Place, inverse_mass: Real) -> Real {
    return Real(INVERSE_GYRATION) * inverse_mass / (place.radius * place.radius);
}

/// rad/s
fn spin_of(i: u32) -> Spin {
    return spin[i];
}

fn keep_spin(i: u32, value: Spin) {
    spin_next[i] = value;
}

fn store_torque(i: u32, value: Spin) {
    torque[i] = value;
}

/// Velocity of the surface point at the end of arm, relative to the centre, m/s.
fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return spin_velocity(spin, arm);
}

/// ω from n - 1/2 to n + 1/2: (2.19) with the acceleration that the moment gives.
fn spun(w: Spin, acceleration: Spin) -> Spin {
    return w + spin_gained(w, acceleration);
}

/// By how much.
fn spin_gained(w: Spin, acceleration: Spin) -> Spin {
    let half = 0.5 * params.dt * params.damping;
    return (params.dt * acceleration - 2 * half * w) / (1 + half);
}

/// ω from 0 to -1/2.
fn spun_back(w: Spin, acceleration: Spin) -> Spin {
    return w - 0.5 * params.dt * (acceleration - params.damping * w);
}

/// ω from n - 1/2 to n: the inverse of the kick.
fn half_spun(w: Spin, acceleration: Spin) -> Spin {
    return (w + 0.5 * params.dt * acceleration) / (1 + 0.5 * params.dt * params.damping);
}

/// n - 1/2 to n + 1/2.
fn advanced_spin(here: Body, torque: Spin) -> Spin {
    if (here.motion.inverse_mass == 0) {
        return here.spin;
    }
    return spun(here.spin, inverse_inertia(here.place, here.motion.inverse_mass) * torque);
}

/// 0 to -1/2.
fn kicked_spin(here: Body, torque: Spin) -> Spin {
    if (here.motion.inverse_mass == 0) {
        return here.spin;
    }
    return spun_back(here.spin, inverse_inertia(here.place, here.motion.inverse_mass) * torque);
}

/// n - 1/2 to n: the inverse of the kick.
fn spin_at_step(here: Body, torque: Spin) -> Spin {
    if (here.motion.inverse_mass == 0) {
        return here.spin;
    }
    return half_spun(here.spin, inverse_inertia(here.place, here.motion.inverse_mass) * torque);
}

/// Kinetic energy of a spin at step n, J.
fn spin_energy(here: Body, w: Spin) -> Real {
    if (here.motion.inverse_mass == 0) {
        return 0;
    }
    return 0.5 * spin_squared(w) / inverse_inertia(here.place, here.motion.inverse_mass);
}

fn ahead_spin_of(i: u32) -> Spin {
    return ahead_spin[i];
}

fn keep_ahead_spin(i: u32, value: Spin) {
    ahead_spin[i] = value;
}

fn trial_spin_of(i: u32) -> Spin {
    return trial_spin[i];
}

fn keep_trial_spin(i: u32, value: Spin) {
    trial_spin[i] = value;
}

fn trial_spin_before_of(i: u32) -> Spin {
    return trial_spin_before[i];
}

fn keep_trial_spin_before(i: u32, value: Spin) {
    trial_spin_before[i] = value;
}
