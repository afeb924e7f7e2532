// twin: src/neighbours/order_neighbours.rs
// Neighbour lists 5: the entries in ascending order of the ids, then walls, and the history of contacts. The order of
// the sum over contacts is thereby fixed by the scene, whenever the lists were made. Large grains, which come last, have
// `order_long_lists`.

/// Sort the entries up to this end, and leave out those without a neighbour and pairs of fixed grains; one past the last.
fn sorted_by_id(list: List, end: u32, fixed: bool) -> u32 {
    var filled = list.begin;
    for (var entry = list.begin; entry < end; entry += list.step) {
        let j = neighbour[entry];
        if (j == NONE || (fixed && velocity[j].inverse_mass == 0)) {
            continue;
        }
        let own_id = id[j];
        var hole = filled;
        for (; hole > list.begin; hole -= list.step) {
            let before = neighbour[hole - list.step];
            if (id[before] < own_id) {
                break;
            }
            neighbour[hole] = before;
        }
        neighbour[hole] = j;
        filled += list.step;
    }
    return filled;
}

@compute @workgroup_size(WG)
fn order_neighbours(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies - params.large || all_entries() > params.entries) {
        return;
    }
    let list = list_of(i);
    let unfilled = entries_across(i) - filled_across(i);
    let grains = sorted_by_id(list, list.end - list.step * unfilled, velocity[i].inverse_mass == 0);
    let filled = list_walls(i, list, grains);
    var inherited = 0u;
    for (var entry = list.begin; entry < filled; entry += list.step) {
        inherited += restore_history(entry, i, neighbour[entry]);
    }
    if (inherited != 0u) {
        atomicAdd(&counters.restored_contacts, inherited);
    }
}
