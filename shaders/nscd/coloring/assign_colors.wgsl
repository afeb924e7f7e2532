// twin: src/nscd/coloring/assign_colors.rs
// Colors 2: contacts that both grains have named get the first colour that neither has, and a place among those of the
// colour.
var<storage, read_write> proposal: array<u32>; // N
var<storage, read_write> coloring_state: ColoringState;
var<storage, read_write> color_count: array<atomic<u32>>; // colours: contacts there are of each

/// Bits of the colours from `first` to first + 31 that the grain of body i has, the contact of i with j left out.
fn colors_of(i: u32, j: u32, first: u32) -> u32 {
    var taken = 0u;
    let members = member_count(i);
    for (var m = 0u; m < members; m++) {
        let member = member_of(i, m);
        let list = list_of(member);
        let end = select(list.end, 0u, is_large(member));
        for (var entry = list.begin; entry < end; entry += lists_abreast()) {
            let tagged = neighbour[entry];
            if (tagged == NONE) {
                break;
            }
            if (member != i || (tagged & INDEX) != j) {
                let above = contact_color[entry].color - first;
                taken |= select(0u, 1u << (above & 31u), above < 32u);
            }
        }
    }
    return taken;
}

@compute @workgroup_size(WG)
fn assign_colors(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicStore(&coloring_state.uncolored, 0u); // proposals are answered
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
        taken = colors_of(i, j, first);
        if (!wall) {
            taken |= colors_of(j, i, first);
        }
        if (taken != 0xffffffffu) {
            break;
        }
        first += 32u;
    }
    let color = first + firstTrailingBit(~taken);
    atomicMax(&coloring_state.colors, color);
    var rank = 0u;
    // Of a colour too many nobody counts the contacts; the host makes room, and begins again.
    if (i < j && color <= params.colors) {
        rank = atomicAdd(&color_count[color - 1u], 1u);
        atomicAdd(&coloring_state.contacts, 1u);
    }
    contact_color[entry_of(i, j)] = ContactColor(color, rank);
}
