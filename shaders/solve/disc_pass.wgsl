// twin: src/solve/jacobi.rs
// A pass, 1 of 3: momentum leads on from the last iterate, and there every contact takes its projected gradient step.
var<storage, read_write> best: array<Packed>; // r of the best pass

@compute @workgroup_size(WG)
fn disc_pass(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(id, groups);
    if (k >= rule.contacts) {
        return;
    }
    // Also where the passes end: what comes after the last of them is this.
    if (best_pass.improved != 0u) {
        best[k] = next[k];
    }
    if (paused()) {
        return;
    }
    let old = x[k];
    var r = unpacked(old.r);
    var u = unpacked(old.u);
    if (solver_state.step_too_long == 0u) {
        let last = Iterate(next[k], u_next[k]);
        x[k] = last;
        // u is affine in r, so that of y costs no product.
        r = unpacked(last.r) + solver_state.beta * (unpacked(last.r) - r);
        u = unpacked(last.u) + solver_state.beta * (unpacked(last.u) - u);
    }
    y[k] = Iterate(packed(r), packed(u));
    next[k] = packed(disc_update(contact_at(contact[k], u), r, step_of(solver_state)));
}
