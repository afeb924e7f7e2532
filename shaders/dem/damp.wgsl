// twin: src/dem/damp.rs
// Adaptive damping 3: what of the velocities is left for the next step, k / (k + 3) in step k since momentum was dropped.
// These are the coefficients of Nesterov's method; they are those of a global damping 3/t (Su, Boyd & Candès 2016).
var<storage, read> halt: u32;
var<storage, read_write> steps_since_restart: u32;

@compute @workgroup_size(WG)
fn damp(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies || halt >= HALTED) {
        return;
    }
    // The host tells by its speed why a grain is lost.
    if (atomicLoad(&counters.lost_body) > 0u) {
        return;
    }
    let next = velocity_next[i];
    if (next.inverse_mass == 0) {
        return;
    }
    let steps = Real(steps_since_restart);
    let left = steps / (steps + 3);
    velocity_next[i] = Velocity(left * next.v, next.inverse_mass);
    scale_next_spin(i, left);
    // Digits that no velocity needs that is damped at once.
    store_velocity_low(i, VelocityLow());
}
