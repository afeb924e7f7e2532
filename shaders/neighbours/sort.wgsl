// twin: src/neighbours/sort.rs
// Broad phase 2: scatter the grains to their cells.
var<storage, read> cell_start: array<u32>;    // cells + 1
var<storage, read> cell_rank: array<u32>;          // N

@compute @workgroup_size(WG)
fn sort(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    sorted[cell_start[cell_index(position[i])] + cell_rank[i]] = i;
}
