// twin: src/kernels/tally.rs
// History 1: how many springs each grain hands over.

@compute @workgroup_size(WG)
fn tally(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i < params.bodies) {
        history_start[i] = springs_kept(i);
    } else if (i == params.bodies) {
        history_start[i] = 0u;
    }
}
