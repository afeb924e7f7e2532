// twin: src/neighbours/bin.rs
// Broad phase 1: histogram of grains over cells, and each grain's rank inside its cell.
var<storage, read_write> cell_start: array<atomic<u32>>;   // cells + 1: counts
var<storage, read_write> cell_rank: array<u32>;                 // N

@compute @workgroup_size(WG)
fn bin(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    cell_rank[i] = atomicAdd(&cell_start[cell_index(position[i])], 1u);
}
