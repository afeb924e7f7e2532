// twin: src/measure/wall_loads.rs
// What free grains do to walls at step n, row by row.
@compute @workgroup_size(WG)
fn wall_loads(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p < params.partial_sums_len) {
        add_up_row(p, true);
    }
}
