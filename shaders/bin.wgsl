// twin: src/kernels/bin.rs
// Broad phase 1: histogram of grains over cells, and each grain's rank inside its cell.
var<storage, read_write> cell_start: array<atomic<u32>>;   // cells + 1: counts
var<storage, read_write> rank: array<u32>;                 // N

@compute @workgroup_size(WG)
fn bin(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    rank[i] = atomicAdd(&cell_start[cell_index(cell_of(place[i].x))], 1u);
}
