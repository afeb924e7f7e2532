// twin: src/neighbours/order_neighbours.rs
// Neighbour lists 5: the entries in ascending order of the ids, then walls, and the history of contacts. The order of
// the sum over contacts is thereby fixed by the scene, whenever the lists were made. Large grains, which come last, have
// `order_long_lists`.

/// Sort these entries, and leave out those without a neighbour and pairs of fixed grains; one past the last.
fn sorted_by_id(begin: u32, end: u32, fixed: bool) -> u32 {
    var filled = begin;
    for (var entry = begin; entry < end; entry++) {
        let j = neighbour[entry];
        if (j == NONE || (fixed && velocity[j].inverse_mass == 0)) {
            continue;
        }
        let own_id = id[j];
        var hole = filled;
        for (; hole > begin; hole--) {
            let before = neighbour[hole - 1u];
            if (id[before] < own_id) {
                break;
            }
            neighbour[hole] = before;
        }
        neighbour[hole] = j;
        filled++;
    }
    return filled;
}

@compute @workgroup_size(WG)
fn order_neighbours(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies - params.large || list_start[params.bodies] > params.entries) {
        return;
    }
    let begin = list_start[i];
    let end = list_start[i + 1u];
    let grains = sorted_by_id(begin, end - (entries_across(i) - filled_across(i)), velocity[i].inverse_mass == 0);
    let filled = list_walls(i, grains, end);
    var inherited = 0u;
    for (var entry = begin; entry < filled; entry++) {
        inherited += restore_history(entry, i, neighbour[entry]);
    }
    if (inherited != 0u) {
        atomicAdd(&counters.restored_contacts, inherited);
    }
}
