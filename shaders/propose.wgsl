// twin: src/kernels/propose.rs
// Colours 1: every body names the neighbour with which it would have a contact coloured next.
var<storage, read_write> proposal: array<u32>; // N: as in the lists; NONE: all have their colours
var<storage, read_write> palette: Palette;

@compute @workgroup_size(WG)
fn propose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    var choice = NONE;
    var best = 0u;
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        if ((entry & SPRUNG) != 0u && hue[slot].colour == 0u) {
            let j = entry & INDEX;
            var other = j;
            if (j < params.bodies) {
                other = number[j];
            }
            let rank = lot(number[i], other);
            // Of equal ranks the last: lists ascend, so there always is a pair that agrees.
            if (choice == NONE || rank >= best) {
                choice = j;
                best = rank;
            }
        }
    }
    proposal[i] = choice;
    if (choice != NONE) {
        atomicStore(&palette.uncoloured, 1u);
    }
}
