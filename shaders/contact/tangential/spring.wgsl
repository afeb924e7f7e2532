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

/// A spring after a step, N, and what sliding takes of it, capped by Coulomb's law.
struct Slid {
    force: Vec,
    excess: Vec,
}

/// old + change, capped by sliding (2.13). A small excess is found from the change, beside which the rounding of the sum
/// may be large.
fn coulomb_capped(old: Vec, change: Vec, pair: Pair, normal_force: Real) -> Slid {
    let limit = pair.friction * max(normal_force, -normal_force);
    let beyond = (dot(old, old) - limit * limit) + dot(change, 2 * old + change);
    let stretched = old + change;
    var excess = Vec();
    if (beyond > 0) {
        let length = sqrt(limit * limit + beyond);
        if (beyond > limit * limit) {
            let force = (limit / length) * stretched;
            return Slid(force, stretched - force);
        }
        excess = (beyond / (length * (length + limit))) * stretched;
    }
    return Slid(accumulated(old, change - excess), excess);
}
