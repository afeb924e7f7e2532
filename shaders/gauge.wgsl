// twin: src/kernels/gauge.rs
// Contact dynamics, the step's length 3: Rayleigh's quotient, from below, with a margin.
@compute @workgroup_size(SUM_LANES)
fn gauge(@builtin(local_invocation_index) lane: u32) {
    let sum = total(lane);
    if (lane == 0u && sum.work > 0) {
        relaxation.stretch = max(relaxation.stretch, 1.02 * sum.way / sum.work);
    }
}
