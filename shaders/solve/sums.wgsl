// twin: src/solve/jacobi.rs (which adds in the order of the contacts)
// Sums over a workgroup, of whatever `Sums` and `combined` are: scenes and problems from files have their own.
const SUM_LANES = 256u;
var<workgroup> of_lane: array<Sums, SUM_LANES>;

/// Lane 0 gets the sum of what the lanes bring, always in the same order.
fn sum_of_lanes(lane: u32, lanes: u32, sums: Sums) -> Sums {
    of_lane[lane] = sums;
    workgroupBarrier();
    var sum = sums;
    if (lane == 0u) {
        for (var l = 1u; l < lanes; l++) {
            sum = combined(sum, of_lane[l]);
        }
    }
    return sum;
}
