// twin: src/kernels/set_out.rs
// Contact dynamics 2: the relaxation of a step begins. What is known of the largest eigenvalue of W serves on.
@compute @workgroup_size(SUM_LANES)
fn set_out(@builtin(local_invocation_index) lane: u32) {
    let sum = total(lane);
    if (lane == 0u) {
        var next = Relaxation();
        next.scale = max(sqrt(max(sum.reference, sum.least)), max(sum.imposed, Real(1e-30)));
        next.crowd = sum.crowd;
        next.stretch = max(relaxation.stretch, Real(1));
        next.theta = 1;
        next.best = 1e30;
        next.lowest = 1e30;
        next.shorter = 1;
        relaxation = next;
    }
}
