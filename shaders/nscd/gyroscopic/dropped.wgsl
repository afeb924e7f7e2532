// twin: src/nscd/gyroscopic.rs
// Gyroscopic slot: a free clump keeps its angular velocity for a step of contact dynamics, as if the products of
// angular velocities were not there. For grains that hardly turn, section 2.2.

/// Change of the spin of a clump in the step if nothing touched it, along the axes of the scene.
fn free_spin_change_of_clump(here: Clump) -> SpinIncrement {
    return SpinIncrement(free_spin_change(here.velocity, here.spin), 0u, true);
}
