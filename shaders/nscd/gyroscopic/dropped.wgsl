// twin: src/nscd/gyroscopic.rs
// Gyroscopic slot: a free clump keeps its angular velocity for a step of contact dynamics, as if the products of
// angular velocities were not there. For grains that hardly turn, section 2.2.

/// Spin of a clump at the end of the step if nothing touched it, rad/s along the axes of the scene.
fn free_spin_of_clump(here: Clump) -> Spin {
    return free_spin_of(here.velocity, here.spin);
}
