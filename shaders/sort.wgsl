// twin: src/kernels/sort.rs
// Broad phase 2: scatter the grains to their cells.
var<storage, read> cell_start: array<u32>;    // cells + 1
var<storage, read> rank: array<u32>;          // N

@compute @workgroup_size(WG)
fn sort(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    sorted[cell_start[cell_index(cell_of(place[i].x))] + rank[i]] = i;
}
