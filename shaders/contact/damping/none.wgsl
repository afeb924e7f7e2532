// twin: src/contact/damping.rs
// Dashpot slot: contacts do not damp.

/// Additional pressing force, N; approach = v_rel · n, inverse_mass = 1/m_i + 1/m_j.
fn dashpot_force(pair: Pair, approach: Real, inverse_mass: Real) -> Real {
    return 0;
}
