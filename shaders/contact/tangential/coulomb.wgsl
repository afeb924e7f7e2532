// twin: src/contact/tangential.rs
// Tangential slot: linear spring with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5.

fn tangential_contact(pair: Pair, c: ContactState, normal_force: Real, old: TangentialHistory) -> Tangential {
    // Turned into the new contact plane (2.11) and stretched by the slip of this step (2.8), (2.9).
    let slip = params.history_dt * (c.v - dot(c.v, c.n) * c.n);
    let change = turning(old.force, c) - pair.tangential_stiffness * slip;
    let slid = coulomb_capped(old.force, change, pair, normal_force);
    return Tangential(slid.force, TangentialHistory(slid.force), sliding_power(old.force, slid, pair));
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
fn sliding_power(old: Vec, slid: Slid, pair: Pair) -> Real {
    if (pair.tangential_stiffness == 0 || params.history_dt == 0) {
        return 0;
    }
    return dot(0.5 * (old + slid.force), slid.excess) / (pair.tangential_stiffness * params.history_dt);
}

/// Energy stored in the spring, J.
fn tangential_energy(pair: Pair, c: ContactState, h: TangentialHistory) -> Real {
    if (pair.tangential_stiffness == 0) {
        return 0;
    }
    return 0.5 * dot(h.force, h.force) / pair.tangential_stiffness;
}
