// twin: src/laws/friction.rs
// Friction slot: smooth grains. No springs, and no array of old lists to take them from.

/// Tangential force on the grain of interest, N.
fn tangential_force(slot: u32, pair: Pair, n: Vec, n_before: Vec, v_rel: Vec, pressing: Real) -> Vec {
    return Vec();
}

/// The contact in this slot is open.
fn forget_spring(slot: u32) {}

/// Take the spring of (i, j) over from the old lists; 1 if there was one.
fn inherit_spring(slot: u32, i: u32, j: u32) -> u32 {
    return 0u;
}

/// Springs of grain i in the old lists.
fn springs_before(i: u32) -> u32 {
    return 0u;
}

/// Energy stored in the spring, J.
fn tangential_energy(slot: u32, pair: Pair) -> Real {
    return 0;
}

/// Length of the spring force, N.
fn tangential_length(slot: u32) -> Real {
    return 0;
}
