// twin: src/laws/rotation.rs
// Rotation slot: nothing turns, so spins and torques do not exist.

fn surface_velocity(i: u32, arm: Vec) -> Vec {
    return Vec();
}

fn store_torque(i: u32, torque: Spin) {}

fn integrate_spin(i: u32, place: Place, inverse_mass: Real) {}

fn half_kick_spin(i: u32, place: Place, inverse_mass: Real) {}

fn spin_energy(i: u32, place: Place, inverse_mass: Real) -> Real {
    return 0;
}
