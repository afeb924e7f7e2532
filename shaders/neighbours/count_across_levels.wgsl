// twin: src/neighbours/count_across_levels.rs
// Neighbour lists 1, of grains of many sizes: how many entries each grain needs for neighbours on other levels. Every
// pair is found by its finer grain.
var<storage, read> cell_start: array<u32>;           // cells + 1

@compute @workgroup_size(WG)
fn count_across_levels(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = position[i];
    var entries = 0u;
    for (var k = level_of(here.radius) + 1u; k < params.levels; k++) {
        let reach = params.margin + counting_slack(k);
        var around = surroundings(here, k);
        let all = spans(around);
        for (var m = 0u; m < all; m++) {
            let cells = span(&around, m);
            let last = cell_start[cells.y];
            for (var j = cell_start[cells.x]; j < last; j++) {
                if (closer_than(here, position[j], reach) && !same_grain(i, j)) {
                    entries++;
                    atomicAdd(&across[j], 1u);
                }
            }
        }
    }
    if (entries != 0u) {
        atomicAdd(&across[i], entries);
    }
}
