// twin: src/kernels/permute.rs
// Grains into the order of the cells, so that neighbours are close in memory.
var<storage, read_write> number_next: array<u32>;    // N

@compute @workgroup_size(WG)
fn permute(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let old = sorted[i];
    let here = body(old);
    place_next[i] = here.place;
    keep_residue(i, here.residue);
    motion_next[i] = here.motion;
    keep_spin(i, here.spin);
    number_next[i] = number[old];
    travel[i] = 0;
    keep_index(number[old], i);
}
