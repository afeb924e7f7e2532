// twin: src/kernels/count.rs
// Neighbour lists 1: how many slots each grain needs, and whether it is still on the right side of every wall.
var<storage, read> place: array<Place>;              // N
var<storage, read> motion: array<Motion>;            // N
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read> sorted: array<u32>;               // N
var<storage, read_write> slot_start: array<u32>;     // N + 1: counts
var<storage, read_write> counters: Counters;

@compute @workgroup_size(WG)
fn count(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = place[i];
    let fixed = motion[i].inverse_mass == 0;
    let home = cell_of(here.x);
    let cells_around = around_count();
    var slots = 0u;
    for (var k = 0u; k < cells_around; k++) {
        let c = around(home, k);
        let last = cell_start[c + 1u];
        for (var s = cell_start[c]; s < last; s++) {
            let j = sorted[s];
            if (j != i && listed(here, place[j], 1.00001) && !(fixed && motion[j].inverse_mass == 0)) {
                slots++;
            }
        }
    }
    for (var w = 0u; w < params.walls && !fixed; w++) {
        let gap = touch_wall(w, here.x, Vec(), here.radius).gap;
        // Rounding grows with the distance from the wall's point; twice the margin leaves room for it.
        if (gap < 2 * params.margin) {
            slots++;
        }
        if (gap < -here.radius) {
            atomicMax(&counters.bad_body, params.bodies - i);
        }
    }
    slot_start[i] = slots;
}
