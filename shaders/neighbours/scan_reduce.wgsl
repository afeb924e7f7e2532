// twin: src/neighbours/scan.rs
// Exclusive prefix sum, 1 of 3 (reduce, then scan: no workgroup waits for another): the sum of each tile.
var<storage, read> values: array<u32>;
var<storage, read_write> tile_sum: array<u32>; // tiles of 256 values

const TILE = 256u;

@compute @workgroup_size(WG)
fn scan_reduce(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = linear(gid, groups);
    let end = min((t + 1u) * TILE, arrayLength(&values));
    if (t * TILE >= end) {
        return;
    }
    var sum = 0u;
    for (var k = t * TILE; k < end; k++) {
        sum = counted(sum, values[k]);
    }
    tile_sum[t] = sum;
}
