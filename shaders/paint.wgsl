// twin: src/kernels/paint.rs
// Colours 2: contacts that both grains have named get the first colour that neither has, and a place among those of the
// colour.
var<storage, read_write> proposal: array<u32>; // N
var<storage, read_write> palette: Palette;
var<storage, read_write> painted: array<atomic<u32>>; // colours: contacts there are of each

/// Bits of the colours from `first` to first + 31 that the grain of body i has, without that of the contact of i with j.
fn colours_of(i: u32, j: u32, first: u32) -> u32 {
    var taken = 0u;
    let members = members_of(i);
    for (var m = 0u; m < members; m++) {
        let member = member_of(i, m);
        let end = slot_start[member + 1u];
        for (var slot = slot_start[member]; slot < end; slot++) {
            let entry = neighbour[slot];
            if (entry == NONE) {
                break;
            }
            if (member != i || (entry & INDEX) != j) {
                let above = hue[slot].colour - first;
                taken |= select(0u, 1u << (above & 31u), above < 32u);
            }
        }
    }
    return taken;
}

/// The slot of neighbour j in the list of grain i.
fn slot_of(i: u32, j: u32) -> u32 {
    var slot = slot_start[i];
    while ((neighbour[slot] & INDEX) != j) {
        slot++;
    }
    return slot;
}

@compute @workgroup_size(WG)
fn paint(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicStore(&palette.uncoloured, 0u); // proposals are answered
    }
    let j = proposal[i];
    if (j == NONE) {
        return;
    }
    let wall = j >= params.bodies;
    if (!wall) {
        if (proposal[j] != i) {
            return;
        }
    }
    var first = 1u;
    var taken = 0u;
    loop {
        taken = colours_of(i, j, first);
        if (!wall) {
            taken |= colours_of(j, i, first);
        }
        if (taken != 0xffffffffu) {
            break;
        }
        first += 32u;
    }
    let colour = first + firstTrailingBit(~taken);
    atomicMax(&palette.colours, colour);
    var rank = 0u;
    // Of a colour too many nobody counts the contacts; the host makes room, and begins again.
    if (i < j && colour <= params.colours) {
        rank = atomicAdd(&painted[colour - 1u], 1u);
        atomicAdd(&palette.contacts, 1u);
    }
    hue[slot_of(i, j)] = Hue(colour, rank);
}
