// twin: src/neighbours/fill_neighbours.rs
// Neighbour lists 3: the neighbours on the level of each grain, in the order of the cells.
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn fill_neighbours(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicMax(&counters.entries_needed, all_entries());
    }
    if (all_entries() > params.entries) {
        atomicMax(&halt, HALTED); // the host will grow the lists and come back
        return;
    }
    let list = list_of(i);
    let end = list.end - list.step * entries_across(i);
    let here = position[i];
    var around = surroundings(here, level_of(here.radius));
    let all = spans(around);
    var entry = list.begin;
    var missed = 0u;
    for (var m = 0u; m < all; m++) {
        let cells = span(&around, m);
        let last = cell_start[cells.y];
        for (var j = cell_start[cells.x]; j < last; j++) {
            if (closer_than(here, position[j], params.margin) && !same_grain(i, j)) {
                if (entry >= end) {
                    missed++;
                    continue;
                }
                neighbour[entry] = j;
                entry += list.step;
            }
        }
    }
    for (; entry < end; entry += list.step) {
        neighbour[entry] = NONE;
    }
    if (missed != 0u) {
        atomicAdd(&counters.unlisted, missed); // cannot happen, see `counting_slack`; if it does, it must be seen
    }
}
