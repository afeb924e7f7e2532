// twin: src/nscd/coloring/count_large_contacts.rs
// Colors, of scenes with large grains: how many contacts that have no colour a grain takes part in.
var<storage, read_write> large_contacts: array<LargeContacts>; // N, see `standing_for`

/// Those of body i with what is small and with what is heavy.
fn large_contacts_of(i: u32, entries: vec2<u32>) -> vec2<u32> {
    var contacts = vec2<u32>();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        if ((tagged & ACTIVE) != 0u && (is_large(i) || is_large(j))) {
            contacts += select(vec2<u32>(1u, 0u), vec2<u32>(0u, 1u), is_heavy(j));
        }
    }
    return contacts;
}

@compute @workgroup_size(GROUP)
fn count_large_contacts(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var contacts = vec2<u32>();
    for (var round = 0u; round < rounds; round++) {
        contacts += large_contacts_of(walk.body, entries_of(walk, round));
    }
    if (any(contacts != vec2<u32>())) {
        let grain = standing_for(walk.body);
        atomicAdd(&large_contacts[grain].small, contacts.x);
        atomicAdd(&large_contacts[grain].heavy, contacts.y);
    }
}
