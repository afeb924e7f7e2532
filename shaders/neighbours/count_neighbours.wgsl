// twin: src/neighbours/count_neighbours.rs
// Neighbour lists 2: how many entries each slice needs at most (pairs of fixed grains are left out when the list is
// ordered), and whether grains are still on the right side of every wall.
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read_write> slice_entries: array<atomic<u32>>; // slices + 1, zeros
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn count_neighbours(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = position[i];
    let fixed = velocity[i].inverse_mass == 0;
    let own = level_of(here.radius);
    let reach = params.margin + counting_slack(own);
    var around = surroundings(here, own);
    let all = spans(around);
    var entries = entries_across(i);
    for (var m = 0u; m < all; m++) {
        let cells = span(&around, m);
        let last = cell_start[cells.y];
        for (var j = cell_start[cells.x]; j < last; j++) {
            if (closer_than(here, position[j], reach) && !same_grain(i, j)) {
                entries++;
            }
        }
    }
    for (var w = 0u; w < params.walls && !fixed; w++) {
        let gap = wall_separation(w, here, position_low_of(i)).gap;
        // Rounding grows with the distance from the wall's point; twice the margin leaves room for it.
        if (gap < 2 * params.margin) {
            entries++;
        }
        if (is_crossed(gap, here.radius)) {
            atomicMax(&counters.lost_body, params.bodies - id[i]);
            atomicMax(&halt, HALTED);
        }
    }
    let lists = select(1u, lists_abreast(), i < params.bodies - params.large);
    atomicMax(&slice_entries[slice_of(i)], lists * entries);
}
