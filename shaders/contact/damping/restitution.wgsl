// twin: src/contact/damping.rs
// Damping slot: pair.dashpot is the damping ratio zeta of the restitution e asked for,
// zeta = -ln e / sqrt(pi² + ln² e), so that every mass rebounds with the same e.

/// Additional compressive force, N; approach = v · n, inverse_mass = 1/m_i + 1/m_j, stiffness is the slope of the
/// normal force, N/m.
fn damping_force(pair: Pair, approach: Real, inverse_mass: Real, stiffness: Real) -> Real {
    return 2 * pair.dashpot * sqrt(stiffness / inverse_mass) * approach;
}
