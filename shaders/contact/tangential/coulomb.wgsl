// twin: src/contact/tangential.rs
// Tangential slot: linear spring with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5. Owns the tangential force.

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
    let stretched = stretched_spring(old.force, pair, c);
    let force = coulomb_capped(stretched, pair, normal_force);
    return Tangential(force, TangentialHistory(force), sliding_power(old.force, stretched, force, pair));
}

/// The old force turned into the new contact plane (2.11) and stretched by the slip of this step (2.8), (2.9), N.
fn stretched_spring(old: Vec, pair: Pair, c: ContactState) -> Vec {
    let turned = transported(old, c.n, c.n_before);
    let slip = params.history_dt * (c.v - dot(c.v, c.n) * c.n);
    return turned - pair.tangential_stiffness * slip;
}

/// Capped by sliding (2.13), N.
fn coulomb_capped(stretched: Vec, pair: Pair, normal_force: Real) -> Vec {
    let limit = pair.friction * max(normal_force, -normal_force);
    let length_squared = dot(stretched, stretched);
    if (length_squared > limit * limit) {
        return stretched * (limit / sqrt(length_squared));
    }
    return stretched;
}

/// Work done by sliding per time, W: the mean force of the step times what the spring was shortened by.
fn sliding_power(old: Vec, stretched: Vec, slid: Vec, pair: Pair) -> Real {
    if (pair.tangential_stiffness == 0 || params.history_dt == 0) {
        return 0;
    }
    return dot(0.5 * (old + slid), stretched - slid) / (pair.tangential_stiffness * params.history_dt);
}

/// Energy stored in the spring, J.
fn tangential_energy(pair: Pair, c: ContactState, h: TangentialHistory) -> Real {
    if (pair.tangential_stiffness == 0) {
        return 0;
    }
    return 0.5 * dot(h.force, h.force) / pair.tangential_stiffness;
}
