// twin: src/nscd/scatter_impulses.rs
// Colors 4: impulses back into the lists of both grains.
var<storage, read_write> coloring_state: ColoringState;

@compute @workgroup_size(WG)
fn scatter_impulses(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let end = atomicLoad(&coloring_state.contacts);
    for (var k = linear(gid, groups); k < end; k += groups.x * groups.y * WG) {
        let contact = colored_contact[k];
        if (contact.first != NONE) {
            let impulse = unpacked(colored_impulse[k]);
            store_impulse(contact.entry, impulse);
            if (contact.back != NONE) {
                store_impulse(contact.back, -impulse);
            }
        }
    }
}
