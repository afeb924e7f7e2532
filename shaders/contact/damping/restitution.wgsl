// twin: src/contact/damping.rs
// Dashpot slot: pair.dashpot is the damping ratio zeta of the restitution e asked for,
// zeta = -ln e / sqrt(pi² + ln² e), so that every mass rebounds with the same e.

/// Additional pressing force, N; approach = v_rel · n, inverse_mass = 1/m_i + 1/m_j.
fn dashpot_force(pair: Pair, approach: Real, inverse_mass: Real) -> Real {
    return 2 * pair.dashpot * sqrt(pair.stiffness / inverse_mass) * approach;
}
