// twin: src/dem/predictor_corrector.rs
// Rotation of clumps in the discrete element method, (2.21)-(2.32).

/// Angular acceleration (2.21)-(2.23) without damping, rad/s².
fn spin_acceleration(here: Clump, w: Spin, torque: Spin) -> Spin {
    return here.inverse_moments * (torque + gyroscopic(w, here.inverse_moments));
}

/// Rounds of predictor and corrector (2.24)-(2.31), until Δω has settled. The torque is along the principal axes. Damping
/// is solved for, as in (2.19), so that the iteration has to find the products of ω alone.
fn predictor_corrector(here: Clump, torque: Spin, before: Spin) -> SpinIncrement {
    var gain = before;
    var count = 0u;
    var settled = false;
    var moved = Real(0x1p100);
    while (!settled && count < MAX_ITERATIONS) {
        let predicted = spin_change(here.spin, spin_acceleration(here, here.spin + 0.5 * gain, torque));
        gain = spin_change(here.spin, spin_acceleration(here, here.spin + 0.5 * predicted, torque));
        count++;
        let moved_before = moved;
        moved = largest(gain - predicted);
        settled = has_settled(moved, moved_before, gain, here.spin);
    }
    return SpinIncrement(gain, count, settled);
}

/// The moment along the axes in which the clump spins.
fn own_torque(here: Clump, torque: Spin) -> Spin {
    return rotate_spin(conjugate(here.orientation), torque);
}

/// Change of the spin to step n, rad/s, in the axes in which the clump spins; the torque is along those of the scene.
fn clump_spin_change_now(c: u32, here: Clump, torque: Spin) -> Spin {
    if (!spins_in_scene(here.inverse_moments)) {
        return 0.5 * predictor_corrector(here, own_torque(here, torque), spin_increment[c]).spin;
    }
    if (here.velocity.inverse_mass == 0) {
        return Spin();
    }
    return spin_change_to_step(here.spin, here.inverse_moments * torque);
}
