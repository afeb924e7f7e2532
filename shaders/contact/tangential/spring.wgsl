// twin: src/contact/tangential.rs
// What tangential springs share: the force that they remember, and Coulomb's cap. Owns the tangential force.

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

/// Capped by sliding (2.13), N.
fn coulomb_capped(stretched: Vec, pair: Pair, normal_force: Real) -> Vec {
    let limit = pair.friction * max(normal_force, -normal_force);
    let length_squared = dot(stretched, stretched);
    if (length_squared > limit * limit) {
        return stretched * (limit / sqrt(length_squared));
    }
    return stretched;
}
