// twin: src/neighbours/scan.rs
// Exclusive prefix sum, 2 of 3: one workgroup scans the sums of the tiles in place.
var<storage, read> values: array<u32>;
var<storage, read_write> tile_sum: array<u32>; // tiles of 256 values

const LANES = 256u;
const TILE = 256u;
var<workgroup> lane_sum: array<u32, LANES>;

@compute @workgroup_size(LANES)
fn scan_top(@builtin(local_invocation_index) lane: u32) {
    let tiles = (arrayLength(&values) + TILE - 1u) / TILE;
    let share = (tiles + LANES - 1u) / LANES;
    let begin = min(lane * share, tiles);
    let end = min(begin + share, tiles);
    var sum = 0u;
    for (var t = begin; t < end; t++) {
        sum = counted(sum, tile_sum[t]);
    }
    lane_sum[lane] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var l = 0u; l < lane; l++) {
        before = counted(before, lane_sum[l]);
    }
    for (var t = begin; t < end; t++) {
        let here = tile_sum[t];
        tile_sum[t] = before;
        before = counted(before, here);
    }
}
