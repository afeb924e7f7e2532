// twin: src/nscd/coloring/count_large_contacts.rs
// Colors, of scenes with large grains: how many contacts that have no colour a grain takes part in.
var<storage, read_write> large_contacts: array<atomic<u32>>; // N, see `standing_for`

fn large_contacts_of(i: u32, entries: vec2<u32>) -> ListSums {
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let has_none = is_large(i) || is_large(tagged & INDEX);
        total.contacts += select(0u, 1u, has_none && (tagged & ACTIVE) != 0u);
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn count_large_contacts(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, large_contacts_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers && total.contacts != 0u) {
        atomicAdd(&large_contacts[standing_for(walk.body)], total.contacts);
    }
}
