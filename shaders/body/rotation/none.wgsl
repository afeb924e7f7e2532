// twin: src/body/rotation.rs
// Rotation slot: nothing turns, so spins and torques do not exist.

fn spin_of(i: u32) -> Spin {
    return Spin();
}

fn store_spin(i: u32, value: Spin) {}

fn scale_next_spin(i: u32, factor: Real) {}

fn store_torque(i: u32, value: Spin) {}

fn surface_velocity(spin: Spin, arm: Vec) -> Vec {
    return Vec();
}

fn sphere_spin_change(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn sphere_spin_change_back(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn sphere_spin_change_to_step(here: Body, torque: Spin) -> Spin {
    return Spin();
}

fn spin_energy(here: Body, w: Spin) -> Real {
    return 0;
}

fn inverse_inertia(position: Position, inverse_mass: Real) -> Real {
    return 0;
}

fn extrapolated_spin_of(i: u32) -> Spin {
    return Spin();
}

fn store_extrapolated_spin(i: u32, value: Spin) {}

fn pass_spin_of(i: u32) -> Spin {
    return Spin();
}

fn store_pass_spin(i: u32, value: Spin) {}

fn pass_spin_before_of(i: u32) -> Spin {
    return Spin();
}

fn store_pass_spin_before(i: u32, value: Spin) {}

fn inverse_rolling_inertia(radius: Real, inverse_mass: Real) -> Real {
    return 0;
}
