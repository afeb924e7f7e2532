// twin: src/contact/tangential.rs
// Tangential slot: Mindlin's contact of elastic spheres without micro-slip, with history, capped by Coulomb's law; for
// the normal slot `hertz`. pair.tangential_stiffness is the effective shear modulus G*, Pa: 1/G* = 2 (2 - nu_i)(1 +
// nu_i)/E_i + 2 (2 - nu_j)(1 + nu_j)/E_j. The stiffness 8 G* √(R* δ) follows the overlap; where that falls the force
// falls with it, so that no cycle of loading gains energy (Thornton, Cummins & Cleary 2013, Powder Technol. 233, 30).

fn tangential_contact(pair: Pair, c: ContactState, normal_force: Real, old: TangentialHistory) -> Tangential {
    let stiffness = tangential_stiffness(pair, c);
    let turn = turning(old.force, c);
    let change = turn - softening(c) * (old.force + turn);
    let held = old.force + change;
    let slip = params.history_dt * (c.v - dot(c.v, c.n) * c.n);
    let slid = coulomb_capped(old.force, change - stiffness * slip, pair, normal_force);
    var dissipation = Real(0);
    if (stiffness > 0 && params.history_dt > 0) {
        let lost = dot(0.5 * (held + slid.force), slid.excess) + 0.5 * dot(held, held) * stiffness_change(c);
        dissipation = lost / (stiffness * params.history_dt);
    }
    return Tangential(slid.force, TangentialHistory(slid.force), dissipation);
}

/// 8 G* √(R* δ), N/m.
fn tangential_stiffness(pair: Pair, c: ContactState) -> Real {
    return 8 * pair.tangential_stiffness * contact_radius(c);
}

/// Energy stored in the spring, J; nothing where the surfaces have parted.
fn tangential_energy(pair: Pair, c: ContactState, h: TangentialHistory) -> Real {
    let stiffness = tangential_stiffness(pair, c);
    if (!(stiffness > 0)) {
        return 0;
    }
    return 0.5 * dot(h.force, h.force) / stiffness;
}
