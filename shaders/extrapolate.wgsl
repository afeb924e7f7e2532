// twin: src/kernels/extrapolate.rs
// Contact dynamics 5: velocities follow their momentum as impulses do, because they depend on them linearly.

@compute @workgroup_size(WG)
fn extrapolate(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let last = trial[i];
    let spin = trial_spin_of(i);
    ahead[i] = Motion(last.v + relaxation.beta * (last.v - trial_before[i].v), last.inverse_mass);
    keep_ahead_spin(i, spin + relaxation.beta * (spin - trial_spin_before_of(i)));
}
