// twin: src/contact/damping.rs
// Dashpot slot: pair.dashpot is a coefficient in 1/s, multiplied by the effective mass.

/// Additional pressing force, N; approach = v_rel · n, inverse_mass = 1/m_i + 1/m_j.
fn dashpot_force(pair: Pair, approach: Real, inverse_mass: Real) -> Real {
    return pair.dashpot / inverse_mass * approach;
}
