// twin: src/contact/normal.rs
// Normal slot: linear spring (2.1).

/// Pressing force, N, for a gap < 0.
fn normal_force(pair: Pair, gap: Real) -> Real {
    return -pair.stiffness * gap;
}

/// Energy stored in the overlap, J.
fn normal_energy(pair: Pair, gap: Real) -> Real {
    return 0.5 * pair.stiffness * gap * gap;
}
