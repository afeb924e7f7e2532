// twin: src/contact/tangential.rs
// Friction slot: tangential spring with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5.
// Owns the springs. Both grains of a contact keep one, equal and opposite, in the slot of their neighbour list; when the
// lists are made anew, the history holds each once.

var<storage, read_write> spring: array<Packed>;         // slots, N: tangential force on the grain of interest
var<storage, read_write> history_start: array<u32>;     // N + 1: of the grain with this index before the sort
var<storage, read_write> history_other: array<u32>;     // contacts: the other's larger index before the sort, or wall
var<storage, read_write> history_spring: array<Packed>; // contacts, N: on the grain with the smaller index

/// The spring in this slot, N.
fn spring_of(entry: u32, tagged: u32) -> Vec {
    if ((tagged & ACTIVE) == 0u) {
        return Vec();
    }
    return unpacked(spring[entry]);
}

/// The same, flagged or not.
fn kept_spring(entry: u32) -> Vec {
    return unpacked(spring[entry]);
}

/// The contact in this slot has this spring now.
fn keep_spring(entry: u32, f: Vec) {
    spring[entry] = packed(f);
}

/// Whether the contact in this slot is closed, so that the spring counts.
fn set_active(entry: u32, tagged: u32, closed: bool) {
    if (closed != ((tagged & ACTIVE) != 0u)) {
        neighbour[entry] = tagged ^ ACTIVE;
    }
}

/// The old spring turned into the new contact plane by the smallest rotation Z from n_before to n (2.11) and stretched by
/// the slip of this step (2.8), (2.9), N.
fn stretched_spring(old: Vec, pair: Pair, n: Vec, n_before: Vec, v_rel: Vec) -> Vec {
    // The lower limit only matters for a grain that passed straight through another: there is no smallest rotation.
    let turned = old - dot(n, old) / max(1 + dot(n, n_before), 1e-6) * (n_before + n);
    let slip = params.history_dt * (v_rel - dot(v_rel, n) * n);
    return turned - pair.tangential_stiffness * slip;
}

/// Capped by sliding (2.13), N.
fn slid_spring(stretched: Vec, pair: Pair, pressing: Real) -> Vec {
    let limit = pair.friction * max(pressing, -pressing);
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

/// Energy stored in a spring, J.
fn spring_energy(f: Vec, pair: Pair) -> Real {
    if (pair.tangential_stiffness == 0) {
        return 0;
    }
    return 0.5 * dot(f, f) / pair.tangential_stiffness;
}

/// How many springs grain i hands to the history: those it shares with a grain of larger index, or a wall.
fn active_contacts(i: u32) -> u32 {
    var kept = 0u;
    for (var entry = list_start[i]; entry < list_start[i + 1u]; entry++) {
        let tagged = neighbour[entry];
        kept += select(0u, 1u, tagged != NONE && (tagged & ACTIVE) != 0u && (tagged & INDEX) > i);
    }
    return kept;
}

/// Hand the springs of grain i to the history.
fn store_history(i: u32) {
    var at = history_start[i];
    for (var entry = list_start[i]; entry < list_start[i + 1u]; entry++) {
        let tagged = neighbour[entry];
        if (tagged != NONE && (tagged & ACTIVE) != 0u && (tagged & INDEX) > i) {
            history_other[at] = tagged & INDEX;
            history_spring[at] = spring[entry];
            at++;
        }
    }
}

/// Take the spring of grain i and neighbour j from the history; 1 if there was one and it is this grain's to count.
fn restore_history(entry: u32, i: u32, j: u32) -> u32 {
    let mine = sorted[i];
    var owner = mine;
    var other = j;
    if (j < params.bodies) {
        owner = min(mine, sorted[j]);
        other = max(mine, sorted[j]);
    }
    var inherited = 0u;
    for (var at = history_start[owner]; at < history_start[owner + 1u]; at++) {
        if (history_other[at] == other) {
            let f = unpacked(history_spring[at]);
            keep_spring(entry, select(-f, f, owner == mine));
            set_active(entry, j, true);
            inherited = select(0u, 1u, owner == mine);
        }
    }
    return inherited;
}
