// twin: src/neighbours/scan.rs
// Exclusive prefix sum, 3 of 3: each tile in place, from the sum of all tiles before it.
var<storage, read_write> values: array<u32>;
var<storage, read> tile_sum: array<u32>; // tiles of 256 values

const TILE = 256u;

@compute @workgroup_size(WG)
fn scan_down(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = linear(gid, groups);
    let end = min((t + 1u) * TILE, arrayLength(&values));
    if (t * TILE >= end) {
        return;
    }
    var before = tile_sum[t];
    for (var k = t * TILE; k < end; k++) {
        let here = values[k];
        values[k] = before;
        before = counted(before, here);
    }
}
