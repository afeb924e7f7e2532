// twin: src/dem/restart.rs
// Adaptive damping 2: momentum is dropped where forces have not done positive work (O'Donoghue & Candès 2015).
var<storage, read> halt: u32;
var<storage, read_write> energy_gain: array<Real>;     // rows of the measurement, J
var<storage, read_write> steps_since_restart: u32;

const LANES = 256u;

var<workgroup> gain_of_lane: array<Real, LANES>;

@compute @workgroup_size(LANES)
fn restart(@builtin(local_invocation_index) lane: u32) {
    var sum = Real();
    for (var p = lane; p < params.partial_sums_len; p += LANES) {
        sum += energy_gain[p];
    }
    gain_of_lane[lane] = sum;
    workgroupBarrier();
    if (lane != 0u || halt >= HALTED) {
        return;
    }
    for (var l = 1u; l < LANES; l++) {
        sum += gain_of_lane[l];
    }
    steps_since_restart = select(0u, steps_since_restart + 1u, sum > 0);
}
