// twin: src/nscd/gyroscopic.rs
// Gyroscopic slot: a free clump keeps its angular momentum for a step of contact dynamics. As all else there it is an
// implicit Euler step: the spin is the one that belongs to the angular momentum when the clump has turned.

/// Spin of a clump at the end of the step if nothing touched it, rad/s along the axes of the scene.
fn free_spin_of_clump(here: Clump) -> Spin {
    var w = free_spin_of(here.velocity, here.spin);
    if (all_equal(here.inverse_moments)) {
        return w;
    }
    let momentum = rotate_spin(here.orientation, own_spin(here, w) / here.inverse_moments);
    var count = 0u;
    var settled = false;
    while (!settled && count < MAX_ITERATIONS) {
        let q = here.orientation + quaternion_product(rotation_increment(0.25 * params.dt * w), here.orientation);
        let next = rotate_spin(q, here.inverse_moments * rotate_spin(conjugate(q), momentum));
        settled = !(largest(next - w) > SPIN_TOLERANCE * largest(next));
        w = next;
        count++;
    }
    count_iterations(count, settled);
    return w;
}
