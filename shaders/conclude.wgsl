// twin: src/kernels/conclude.rs
// Contact dynamics 7: the judgement, for the host. Passes may go on.
@compute @workgroup_size(SUM_LANES)
fn conclude(@builtin(local_invocation_index) lane: u32) {
    let sum = total(lane);
    if (lane == 0u) {
        relaxation.residual = sqrt(sum.residual) / relaxation.scale;
        relaxation.late = sum.late;
        if (sum.late > 0u) {
            // With more contacts the residual begins anew.
            relaxation.lowest = 1e30;
            relaxation.lowest_at = relaxation.passes;
        }
        relaxation.excess = max(sum.excess, Real(0)) / max(sum.pressing, Real(1e-36));
    }
}
