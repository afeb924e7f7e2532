// twin: src/solve/jacobi.rs (which adds in the order of the contacts)
// Sums over a workgroup, of whatever `Sums` and `combined` are: scenes and problems from files have their own.
const SUM_LANES = 256u;
/// Lanes that bring what they have at a time: more would need so much memory that few workgroups could run at once.
const PLACES = 64u;
var<workgroup> of_lane: array<Sums, PLACES>;

/// Lane 0 gets the sum of what the lanes bring, always in the same order.
fn sum_of_lanes(lane: u32, lanes: u32, sums: Sums) -> Sums {
    var sum = sums;
    for (var first = 0u; first < lanes; first += PLACES) {
        if (lane / PLACES == first / PLACES) {
            of_lane[lane % PLACES] = sums;
        }
        workgroupBarrier();
        for (var l = select(0u, 1u, first == 0u); l < PLACES && lane == 0u; l++) {
            sum = combined(sum, of_lane[l]);
        }
        workgroupBarrier();
    }
    return sum;
}
