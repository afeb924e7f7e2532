// twin: src/kernels/deliver.rs
// Colours 4: impulses back into the lists of both grains.
var<storage, read_write> palette: Palette;

@compute @workgroup_size(WG)
fn deliver(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let end = atomicLoad(&palette.contacts);
    for (var k = linear(id, groups); k < end; k += groups.x * groups.y * WG) {
        let contact = turn[k];
        if (contact.first != NONE) {
            let impulse = unpacked(thrust[k]);
            keep_spring(contact.slot, impulse);
            if (contact.back != NONE) {
                keep_spring(contact.back, -impulse);
            }
        }
    }
}
