// twin: src/kernels/neighbours.rs
// Neighbour lists 2: fill the slots with ids in ascending order (walls come last: wall w is bodies + w) and bring the
// springs along. The order of the sum over contacts is thereby fixed by id, whenever the lists were made.
var<storage, read> place: array<Place>;              // N
var<storage, read> motion: array<Motion>;            // N
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read> sorted: array<u32>;               // N
var<storage, read> slot_start: array<u32>;           // N + 1
var<storage, read_write> neighbour: array<u32>;      // slots
var<storage, read_write> counters: Counters;

@compute @workgroup_size(WG)
fn neighbours(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicMax(&counters.slots_needed, slot_start[params.bodies]);
    }
    let begin = slot_start[i];
    let end = slot_start[i + 1u];
    if (end > arrayLength(&neighbour)) {
        return;
    }
    let here = place[i];
    let fixed = motion[i].inverse_mass == 0;
    let home = cell_of(here.x);
    let cells_around = around_count();
    var slot = begin;
    for (var k = 0u; k < cells_around; k++) {
        let c = around(home, k);
        let last = cell_start[c + 1u];
        for (var s = cell_start[c]; s < last; s++) {
            let j = sorted[s];
            if (j != i && listed(here, place[j], 1) && !(fixed && motion[j].inverse_mass == 0)) {
                if (slot == end) {
                    atomicAdd(&counters.lost, 1u); // cannot happen, see `listed`; if it does, it must be seen
                    continue;
                }
                var hole = slot;
                while (hole > begin && neighbour[hole - 1u] > j) {
                    neighbour[hole] = neighbour[hole - 1u];
                    hole--;
                }
                neighbour[hole] = j;
                slot++;
            }
        }
    }
    for (var w = 0u; w < params.walls && !fixed; w++) {
        if (touch_wall(w, here.x, Vec(), here.radius).gap < params.margin) {
            if (slot == end) {
                atomicAdd(&counters.lost, 1u);
                continue;
            }
            neighbour[slot] = params.bodies + w;
            slot++;
        }
    }
    for (; slot < end; slot++) {
        neighbour[slot] = NONE;
    }
    var inherited = 0u;
    for (slot = begin; slot < end; slot++) {
        inherited += inherit_spring(slot, i, neighbour[slot]);
    }
    let before = springs_before(i);
    if (inherited < before) {
        atomicAdd(&counters.lost, before - inherited);
    }
}
