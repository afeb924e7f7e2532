// twin: src/laws/rotation.rs
// Rotation slot: bodies with J1 = J2 = J3, for which the predictor-corrector (2.24)-(2.32) has a closed form and no
// orientation is needed. Owns spin and torque.

var<storage, read_write> spin: array<Spin>;   // N, rad/s, at the half step n - 1/2
var<storage, read_write> torque: array<Spin>; // N, N m, at step n

/// 1/J.
fn inverse_inertia(place: Place, inverse_mass: Real) -> Real {
    return Real(INVERSE_GYRATION) * inverse_mass / (place.radius * place.radius);
}

/// rad/s
fn spin_of(i: u32) -> Spin {
    return spin[i];
}

/// Velocity of the surface point at the end of arm, relative to the centre, m/s.
fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return spin_velocity(spin, arm);
}

fn store_torque(i: u32, value: Spin) {
    torque[i] = value;
}

/// n - 1/2 to n + 1/2: (2.19) with the moment in place of the force.
fn integrate_spin(i: u32, place: Place, inverse_mass: Real) {
    if (inverse_mass == 0) {
        return;
    }
    let half = 0.5 * params.dt * params.damping;
    spin[i] = ((1 - half) * spin[i] + params.dt * inverse_inertia(place, inverse_mass) * torque[i]) / (1 + half);
}

/// 0 to -1/2.
fn half_kick_spin(i: u32, place: Place, inverse_mass: Real) {
    if (inverse_mass == 0) {
        return;
    }
    let acceleration = inverse_inertia(place, inverse_mass) * torque[i] - params.damping * spin[i];
    spin[i] -= 0.5 * params.dt * acceleration;
}

/// Kinetic energy of the spin at step n, J.
fn spin_energy(i: u32, place: Place, inverse_mass: Real) -> Real {
    if (inverse_mass == 0) {
        return 0;
    }
    let j = inverse_inertia(place, inverse_mass);
    let w = (spin[i] + 0.5 * params.dt * j * torque[i]) / (1 + 0.5 * params.dt * params.damping);
    return 0.5 * spin_squared(w) / j;
}
