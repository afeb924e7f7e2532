// twin: src/kernels/order.rs
// Broad phase 3: ascending numbers inside each cell, whatever order the atomics of the histogram gave them.
var<storage, read> cell_start: array<u32>;    // cells + 1

@compute @workgroup_size(WG)
fn order(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.cells.x * params.cells.y * params.cells.z) {
        return;
    }
    let begin = cell_start[c];
    for (var k = begin + 1u; k < cell_start[c + 1u]; k++) {
        let here = sorted[k];
        let label = number[here];
        var hole = k;
        while (hole > begin && number[sorted[hole - 1u]] > label) {
            sorted[hole] = sorted[hole - 1u];
            hole--;
        }
        sorted[hole] = here;
    }
}
