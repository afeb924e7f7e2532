// twin: src/neighbours/fill_neighbours.rs
// Neighbour lists 2: fill the entries in ascending order of the ids (walls come last) and bring the history of
// contacts along. The order of the sum over contacts is thereby fixed by the scene, whenever the lists were made.
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read_write> halt: atomic<u32>;

/// Sort these entries, and leave out pairs of fixed grains; one past the last. Done after the search, because most of
/// what is searched is no neighbour.
fn sorted_by_id(begin: u32, end: u32, fixed: bool) -> u32 {
    var filled = begin;
    for (var entry = begin; entry < end; entry++) {
        let j = neighbour[entry];
        if (fixed && velocity[j].inverse_mass == 0) {
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
fn fill_neighbours(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicMax(&counters.entries_needed, list_start[params.bodies]);
    }
    if (list_start[params.bodies] > params.entries) {
        atomicStore(&halt, 1u); // the host will grow the lists and come back
        return;
    }
    let begin = list_start[i];
    let end = list_start[i + 1u];
    let here = position[i];
    let fixed = velocity[i].inverse_mass == 0;
    let home = cell_of(here.x);
    let all = spans();
    var entry = begin;
    var missed = 0u;
    for (var k = 0u; k < all; k++) {
        let cells = span(home, k);
        let last = cell_start[cells.y];
        for (var j = cell_start[cells.x]; j < last; j++) {
            if (closer_than(here, position[j], params.margin) && !same_grain(i, j)) {
                if (entry == end) {
                    missed++;
                    continue;
                }
                neighbour[entry] = j;
                entry++;
            }
        }
    }
    entry = sorted_by_id(begin, entry, fixed);
    for (var w = 0u; w < params.walls && !fixed; w++) {
        if (wall_separation(w, here, position_low_of(i)).gap < params.margin) {
            if (entry == end) {
                missed++;
                continue;
            }
            neighbour[entry] = params.bodies + w;
            entry++;
        }
    }
    let filled = entry;
    for (; entry < end; entry++) {
        neighbour[entry] = NONE;
    }
    var inherited = 0u;
    for (entry = begin; entry < filled; entry++) {
        inherited += restore_history(entry, i, neighbour[entry]);
    }
    if (inherited != 0u) {
        atomicAdd(&counters.restored_contacts, inherited);
    }
    if (missed != 0u) {
        atomicAdd(&counters.unlisted, missed); // cannot happen, see `count_neighbours`; if it does, it must be seen
    }
}
