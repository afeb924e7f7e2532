// twin: src/neighbours/order_cells.rs
// Broad phase 3: ascending numbers inside each cell, whatever order the atomics of the histogram gave them.
var<storage, read> cell_start: array<u32>;    // cells + 1

@compute @workgroup_size(WG)
fn order_cells(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.cells) {
        return;
    }
    let begin = cell_start[c];
    for (var k = begin + 1u; k < cell_start[c + 1u]; k++) {
        let here = sorted[k];
        let own_id = id[here];
        var hole = k;
        while (hole > begin && id[sorted[hole - 1u]] > own_id) {
            sorted[hole] = sorted[hole - 1u];
            hole--;
        }
        sorted[hole] = here;
    }
}
