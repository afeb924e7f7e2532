// twin: src/nscd/coloring/propose.rs
// Colors 1: every body names the neighbour with which it would have a contact coloured next. Contacts of large grains get
// no colour: `relax_large` has them.
var<storage, read_write> proposal: array<u32>; // N: as in the lists; NONE: all have their colours
var<storage, read_write> coloring_state: ColoringState;

@compute @workgroup_size(WG)
fn propose(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    var choice = NONE;
    var best = 0u;
    let list = list_of(i);
    let end = select(list.end, 0u, is_large(i));
    for (var entry = list.begin; entry < end; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        if ((tagged & ACTIVE) != 0u && contact_color[entry].color == 0u && !is_large(j)) {
            var other = j;
            if (j < params.bodies) {
                other = id[j];
            }
            let rank = priority(id[i], other);
            // Of equal ranks the last: lists ascend, so there always is a pair that agrees.
            if (choice == NONE || rank >= best) {
                choice = j;
                best = rank;
            }
        }
    }
    proposal[i] = choice;
    if (choice != NONE) {
        atomicStore(&coloring_state.uncolored, 1u);
    }
}
