// twin: src/laws/rotation.rs
// Rotation slot: nothing turns, so spins and torques do not exist.

fn spin_of(i: u32) -> Spin {
    return Spin();
}

fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return Vec();
}

fn store_torque(i: u32, torque: Spin) {}

fn integrate_spin(i: u32, place: Place, inverse_mass: Real) {}

fn half_kick_spin(i: u32, place: Place, inverse_mass: Real) {}

fn spin_energy(i: u32, place: Place, inverse_mass: Real) -> Real {
    return 0;
}
