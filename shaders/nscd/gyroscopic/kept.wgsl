// twin: src/nscd/gyroscopic.rs
// Gyroscopic slot: a free clump keeps its angular momentum for a step of contact dynamics. As all else there it is an
// implicit Euler step: the spin is the one that belongs to the angular momentum when the clump has turned.

/// Change of the spin of a clump in the step if nothing touched it, along the axes of the scene. It is added up of
/// changes, because the difference of two spins loses its digits.
fn free_spin_change_of_clump(here: Clump) -> SpinIncrement {
    let damped = free_spin_change(here.velocity, here.spin);
    if (all_equal(here.inverse_moments)) {
        return SpinIncrement(damped, 0u, true);
    }
    let w = here.spin + damped;
    let momentum = rotate_spin(here.orientation, own_spin(here, w) / here.inverse_moments);
    var free = SpinIncrement(Spin(), 0u, false);
    var moved = Real(0x1p100);
    while (!free.settled && free.rounds < MAX_ITERATIONS) {
        let turn = rotation_increment(0.25 * params.dt * (w + free.spin));
        // The momentum that stays, seen from the axes that turn; the spin that it gives, seen from the scene.
        let seen = rotated_spin_change(conjugate(turn), momentum);
        let own = rotate_spin(conjugate(here.orientation), seen);
        let given = rotate_spin(here.orientation, here.inverse_moments * own);
        let next = given + rotated_spin_change(turn, w + given);
        let moved_before = moved;
        moved = largest(next - free.spin);
        free.settled = has_settled(moved, moved_before, next, w);
        free.spin = next;
        free.rounds++;
    }
    free.spin += damped;
    return free;
}
