// twin: src/measure/wall_loads.rs
// What free grains do to walls at step n, row by row.
@compute @workgroup_size(WG)
fn wall_loads(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(gid, groups);
    if (k < params.partial_sums_len * params.walls) {
        wall_load_sums[k] = wall_loads_of_row(k);
    }
}
