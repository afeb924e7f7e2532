// twin: src/nscd/contact.rs
// What a contact of rigid grains remembers: its impulse, with which the next step begins.

var<storage, read_write> impulse: array<Packed>;         // entries, N s: on the grain of interest
var<storage, read_write> history_impulse: array<Packed>; // contacts, N s: on the grain with the smaller index

struct History {
    impulse: Vec, // N s
}

/// The impulse at this entry.
fn impulse_of(entry: u32) -> Vec {
    return unpacked(impulse[entry]);
}

fn store_impulse(entry: u32, r: Vec) {
    impulse[entry] = packed(r);
}

/// That of the last step, N s.
fn warm_start_impulse(entry: u32, tagged: u32) -> Vec {
    if ((tagged & ACTIVE) == 0u) {
        return Vec();
    }
    return impulse_of(entry);
}

fn store_lanes(at: u32, entry: u32) {
    history_impulse[at] = impulse[entry];
}

fn restore_lanes(entry: u32, at: u32, same: bool) {
    let r = unpacked(history_impulse[at]);
    store_impulse(entry, select(-r, r, same));
}

/// Nothing: rigid grains store no energy.
fn forgotten_energy(i: u32, here: Body, entry: u32, tagged: u32) -> Real {
    return 0;
}
