// twin: src/contact/tangential.rs
// Tangential slot: Mindlin's contact of elastic spheres without micro-slip, with history, capped by Coulomb's law; for the normal slot
// `hertz`. pair.tangential_stiffness is the effective shear modulus G*, Pa: 1/G* = 2 (2 - nu_i)(1 + nu_i)/E_i + 2 (2 - nu_j)(1 + nu_j)/E_j.
// The stiffness 8 G* √(R* δ) follows the overlap; where that falls the force falls with it, so that no cycle of loading gains energy
// (Thornton, Cummins & Cleary 2013, Powder Technol. 233, 30). Owns the tangential force.

var<storage, read_write> tangential_force: array<Packed>;         // entries, N: on the grain of interest
var<storage, read_write> history_tangential_force: array<Packed>; // contacts, N: on the grain with the smaller index

/// What a contact remembers.
struct TangentialHistory {
    force: Vec, // N
}

/// The tangential part of a contact, on the first of the two.
struct Tangential {
    force: Vec, // N
    history: TangentialHistory,
    dissipation: Real, // W, of sliding
}

/// That of the contact at this entry.
fn tangential_history(entry: u32, tagged: u32) -> TangentialHistory {
    if ((tagged & ACTIVE) == 0u) {
        return TangentialHistory();
    }
    return TangentialHistory(unpacked(tangential_force[entry]));
}

fn set_tangential_history(entry: u32, h: TangentialHistory) {
    tangential_force[entry] = packed(h.force);
}

/// As the other of the two sees it, if `back`.
fn opposite_tangential(h: TangentialHistory, back: bool) -> TangentialHistory {
    return TangentialHistory(select(h.force, -h.force, back));
}

fn store_tangential(at: u32, entry: u32) {
    history_tangential_force[at] = tangential_force[entry];
}

fn restore_tangential(entry: u32, at: u32, same: bool) {
    set_tangential_history(entry, opposite_tangential(TangentialHistory(unpacked(history_tangential_force[at])), !same));
}

fn tangential_contact(pair: Pair, c: ContactState, normal_force: Real, old: TangentialHistory) -> Tangential {
    let stiffness = tangential_stiffness(pair, c);
    let held = softening(c) * transported(old.force, c.n, c.n_before);
    let stretched = held - stiffness * (params.history_dt * (c.v - dot(c.v, c.n) * c.n));
    let limit = pair.friction * max(normal_force, -normal_force);
    let length_squared = dot(stretched, stretched);
    var force = stretched;
    if (length_squared > limit * limit) {
        force = stretched * (limit / sqrt(length_squared));
    }
    var dissipation = Real(0);
    if (stiffness > 0 && params.history_dt > 0) {
        dissipation = dot(0.5 * (held + force), stretched - force) / (stiffness * params.history_dt);
    }
    return Tangential(force, TangentialHistory(force), dissipation);
}

/// 8 G* √(R* δ), N/m.
fn tangential_stiffness(pair: Pair, c: ContactState) -> Real {
    return 8 * pair.tangential_stiffness * contact_radius(c);
}

/// By what the stiffness has fallen since the last step: √(δ / δ before), at most 1.
fn softening(c: ContactState) -> Real {
    if (c.gap > c.gap_before && c.gap_before < 0) {
        return sqrt(max(-c.gap, Real(0)) / -c.gap_before);
    }
    return 1;
}

/// Energy stored in the spring, J; nothing where the surfaces have parted.
fn tangential_energy(pair: Pair, c: ContactState, h: TangentialHistory) -> Real {
    let stiffness = tangential_stiffness(pair, c);
    if (!(stiffness > 0)) {
        return 0;
    }
    return 0.5 * dot(h.force, h.force) / stiffness;
}
