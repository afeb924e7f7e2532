// twin: src/kernels/neighbours.rs
// Neighbour lists 2: fill the slots in ascending order of the numbers (walls come last) and bring the springs along. The
// order of the sum over contacts is thereby fixed by the scene, whenever the lists were made.
var<storage, read> cell_start: array<u32>;           // cells + 1
var<storage, read_write> halt: atomic<u32>;

/// Sort these slots, and leave out pairs of fixed grains; one past the last. Done after the search, because most of what
/// is searched is no neighbour.
fn sorted_by_number(begin: u32, end: u32, fixed: bool) -> u32 {
    var filled = begin;
    for (var slot = begin; slot < end; slot++) {
        let j = neighbour[slot];
        if (fixed && motion[j].inverse_mass == 0) {
            continue;
        }
        let label = number[j];
        var hole = filled;
        for (; hole > begin; hole--) {
            let before = neighbour[hole - 1u];
            if (number[before] < label) {
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
fn neighbours(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicMax(&counters.slots_needed, slot_start[params.bodies]);
    }
    if (slot_start[params.bodies] > params.slots) {
        atomicStore(&halt, 1u); // the host will grow the lists and come back
        return;
    }
    let begin = slot_start[i];
    let end = slot_start[i + 1u];
    let here = place[i];
    let fixed = motion[i].inverse_mass == 0;
    let home = cell_of(here.x);
    let all = spans();
    var slot = begin;
    var missed = 0u;
    for (var k = 0u; k < all; k++) {
        let cells = span(home, k);
        let last = cell_start[cells.y];
        for (var j = cell_start[cells.x]; j < last; j++) {
            if (within(here, place[j], params.margin) && !same_grain(i, j)) {
                if (slot == end) {
                    missed++;
                    continue;
                }
                neighbour[slot] = j;
                slot++;
            }
        }
    }
    slot = sorted_by_number(begin, slot, fixed);
    for (var w = 0u; w < params.walls && !fixed; w++) {
        if (touch_wall(w, here, residue_of(i)).gap < params.margin) {
            if (slot == end) {
                missed++;
                continue;
            }
            neighbour[slot] = params.bodies + w;
            slot++;
        }
    }
    let filled = slot;
    for (; slot < end; slot++) {
        neighbour[slot] = NONE;
    }
    var inherited = 0u;
    for (slot = begin; slot < filled; slot++) {
        inherited += inherit_spring(slot, i, neighbour[slot]);
    }
    if (inherited != 0u) {
        atomicAdd(&counters.inherited, inherited);
    }
    if (missed != 0u) {
        atomicAdd(&counters.missed, missed); // cannot happen, see `count`; if it does, it must be seen
    }
}
