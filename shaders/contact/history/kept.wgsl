// twin: src/contact/history.rs
// History slot: contacts remember something. Both grains of a contact keep it, as each sees it, at the entry of their
// neighbour list; when the lists are made anew, the history holds each contact once. What it is, those say who own it:
// `store_lanes`, `restore_lanes`.

var<storage, read_write> history_start: array<u32>; // N + 1: of the grain with this index before the sort
var<storage, read_write> history_other: array<u32>; // contacts: the other's larger index before the sort, or wall

/// Whether the contact at this entry is active, so that what it remembers counts.
fn set_active(entry: u32, tagged: u32, counts: bool) {
    if (counts != ((tagged & ACTIVE) != 0u)) {
        neighbour[entry] = tagged ^ ACTIVE;
    }
}

/// How many contacts grain i hands to the history: those it shares with a grain of larger index, or a wall.
fn active_contacts(i: u32) -> u32 {
    var kept = 0u;
    let list = list_of(i);
    for (var entry = list.begin; entry < list.end; entry += list.step) {
        let tagged = neighbour[entry];
        kept += select(0u, 1u, tagged != NONE && (tagged & ACTIVE) != 0u && (tagged & INDEX) > i);
    }
    return kept;
}

/// Hand the contacts of grain i to the history.
fn store_history(i: u32) {
    var at = history_start[i];
    let list = list_of(i);
    for (var entry = list.begin; entry < list.end; entry += list.step) {
        let tagged = neighbour[entry];
        if (tagged != NONE && (tagged & ACTIVE) != 0u && (tagged & INDEX) > i) {
            history_other[at] = tagged & INDEX;
            store_lanes(at, entry);
            at++;
        }
    }
}

/// Take the contact of grain i and neighbour j from the history; 1 if there was one and it is this grain's to count.
fn restore_history(entry: u32, i: u32, j: u32) -> u32 {
    let mine = sorted[i];
    var owner = mine;
    var other = j;
    if (j < params.bodies) {
        owner = min(mine, sorted[j]);
        other = max(mine, sorted[j]);
    }
    var restored = 0u;
    for (var at = history_start[owner]; at < history_start[owner + 1u]; at++) {
        if (history_other[at] == other) {
            restore_lanes(entry, at, owner == mine);
            set_active(entry, j, true);
            restored = select(0u, 1u, owner == mine);
        }
    }
    return restored;
}
