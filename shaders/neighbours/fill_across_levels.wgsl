// twin: src/neighbours/fill_across_levels.rs
// Neighbour lists 4, of grains of many sizes: the pairs of two levels, on the lists of both, in any order.
var<storage, read> cell_start: array<u32>;           // cells + 1

/// Put j on the list of grain i; 1 if it found no entry.
fn list_across(i: u32, j: u32) -> u32 {
    let own = entries_across(i);
    let filled = atomicAdd(&across_filled[i], 1u);
    if (filled >= own) {
        return 1u;
    }
    let list = list_of(i);
    neighbour[list.end - list.step * (own - filled)] = j;
    return 0u;
}

@compute @workgroup_size(WG)
fn fill_across_levels(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies || all_entries() > params.entries) {
        return;
    }
    let here = position[i];
    var missed = 0u;
    for (var k = level_of(here.radius) + 1u; k < params.levels; k++) {
        var around = surroundings(here, k);
        let all = spans(around);
        for (var m = 0u; m < all; m++) {
            let cells = span(&around, m);
            let last = cell_start[cells.y];
            for (var j = cell_start[cells.x]; j < last; j++) {
                if (closer_than(here, position[j], params.margin) && !same_grain(i, j)) {
                    missed += list_across(i, j) + list_across(j, i);
                }
            }
        }
    }
    if (missed != 0u) {
        atomicAdd(&counters.unlisted, missed); // cannot happen, as in `fill_neighbours`
    }
}
