// twin: src/laws/gyration.rs
// Gyration slot: a free clump keeps its angular momentum for a step of contact dynamics. As all else there it is an implicit Euler
// step: the spin is the one that belongs to the angular momentum when the clump has turned.

/// Spin of a clump at the end of the step if nothing touched it, rad/s along the axes of the scene.
fn free_spin_of_clump(here: Clump) -> Spin {
    var w = freed_spin(here.motion, here.spin);
    if (all_equal(here.inverse_moments)) {
        return w;
    }
    let momentum = turned_spin(here.attitude, own_spin(here, w) / here.inverse_moments);
    var count = 0u;
    var settled = false;
    while (!settled && count < MOST_ROUNDS) {
        let q = here.attitude + product(attitude_gain(0.25 * params.dt * w), here.attitude);
        let next = turned_spin(q, here.inverse_moments * turned_spin(conjugate(q), momentum));
        settled = !(largest(next - w) > SPIN_TOLERANCE * largest(next));
        w = next;
        count++;
    }
    count_rounds(count, settled);
    return w;
}
