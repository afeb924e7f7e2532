// twin: src/contact/damping.rs
// Damping slot: contacts do not damp.

/// Additional compressive force, N; approach = v · n, inverse_mass = 1/m_i + 1/m_j, stiffness is the slope of the
/// normal force, N/m.
fn damping_force(pair: Pair, approach: Real, inverse_mass: Real, stiffness: Real) -> Real {
    return 0;
}
