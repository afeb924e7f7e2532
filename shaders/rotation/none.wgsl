// twin: src/laws/rotation.rs
// Rotation slot: nothing turns, so spins and torques do not exist.

fn spin_of(i: u32) -> Spin {
    return Spin();
}

fn keep_spin(i: u32, value: Spin) {}

fn store_torque(i: u32, value: Spin) {}

fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return Vec();
}

fn advanced_spin(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn kicked_spin(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn spin_at_step(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn spin_energy(here: Body, w: Spin) -> Real {
    return 0;
}

fn inverse_inertia(place: Place, inverse_mass: Real) -> Real {
    return 0;
}

fn ahead_spin_of(i: u32) -> Spin {
    return Spin();
}

fn keep_ahead_spin(i: u32, value: Spin) {}

fn trial_spin_of(i: u32) -> Spin {
    return Spin();
}

fn keep_trial_spin(i: u32, value: Spin) {}

fn trial_spin_before_of(i: u32) -> Spin {
    return Spin();
}

fn keep_trial_spin_before(i: u32, value: Spin) {}
