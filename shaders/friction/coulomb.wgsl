// twin: src/laws/friction.rs
// Friction slot: tangential spring with history, capped by Coulomb's law (2.7)-(2.14), errata E4, E5.
// Owns the springs; both grains of a contact keep one, equal and opposite, in the slot of their neighbour list.

var<storage, read_write> spring: array<Vec>;              // slots, N: tangential force on the grain of interest
var<storage, read> spring_before: array<Vec>;             // the lists of the chunk before
var<storage, read> neighbour_before: array<u32>;
var<storage, read> slot_start_before: array<u32>;         // N + 1

/// Tangential force on the grain of interest, N: the old spring turned into the new contact plane by the smallest
/// rotation Z from n_before to n (2.11), stretched by the slip of this step (2.8), (2.9), capped (2.13).
fn tangential_force(slot: u32, pair: Pair, n: Vec, n_before: Vec, v_rel: Vec, pressing: Real) -> Vec {
    let old = spring[slot];
    // The lower limit only matters for a grain that passed straight through another: there is no smallest rotation.
    let turned = old - dot(n, old) / max(1 + dot(n, n_before), 1e-6) * (n_before + n);
    let slip = params.dt * (v_rel - dot(v_rel, n) * n);
    var f = turned - pair.tangential_stiffness * slip;
    let limit = pair.friction * max(pressing, -pressing);
    let length_squared = dot(f, f);
    if (length_squared > limit * limit) {
        f *= limit / sqrt(length_squared);
    }
    spring[slot] = f;
    return f;
}

/// The contact in this slot is open.
fn forget_spring(slot: u32) {
    spring[slot] = Vec();
}

/// Take the spring of (i, j) over from the old lists (sorted by id); 1 if there was one.
fn inherit_spring(slot: u32, i: u32, j: u32) -> u32 {
    var low = slot_start_before[i];
    var high = slot_start_before[i + 1u];
    while (low < high) {
        let middle = (low + high) / 2u;
        if (neighbour_before[middle] < j) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var f = Vec();
    if (low < slot_start_before[i + 1u] && neighbour_before[low] == j) {
        f = spring_before[low];
    }
    spring[slot] = f;
    return select(0u, 1u, any(f != Vec()));
}

/// Springs of grain i in the old lists.
fn springs_before(i: u32) -> u32 {
    var count = 0u;
    for (var slot = slot_start_before[i]; slot < slot_start_before[i + 1u]; slot++) {
        count += select(0u, 1u, any(spring_before[slot] != Vec()));
    }
    return count;
}

/// Energy stored in the spring, J.
fn tangential_energy(slot: u32, pair: Pair) -> Real {
    let f = spring[slot];
    if (pair.tangential_stiffness == 0) {
        return 0;
    }
    return 0.5 * dot(f, f) / pair.tangential_stiffness;
}

/// Length of the spring force, N.
fn tangential_length(slot: u32) -> Real {
    return sqrt(dot(spring[slot], spring[slot]));
}
