// twin: src/kernels/deliver.rs
// Colours 4: impulses back into the lists of both grains.
var<storage, read_write> painted: array<u32>; // colours: contacts there are of each

@compute @workgroup_size(WG)
fn deliver(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(id, groups);
    var end = 0u;
    for (var colour = 0u; colour < params.colours; colour++) {
        end += painted[colour];
    }
    if (k >= end) {
        return;
    }
    let contact = turn[k];
    if (contact.first == NONE) {
        return;
    }
    let impulse = unpacked(thrust[k]);
    keep_spring(contact.slot, impulse);
    if (contact.back != NONE) {
        keep_spring(contact.back, -impulse);
    }
}
