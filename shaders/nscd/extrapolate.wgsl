// twin: src/nscd/extrapolate.rs
// Contact dynamics 5: velocities follow their momentum as impulses do, because they depend on them linearly.

@compute @workgroup_size(WG)
fn extrapolate(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let last = pass_velocity[i];
    let spin = pass_spin_of(i);
    let v = last.v + solver_state.beta * (last.v - pass_velocity_before[i].v);
    extrapolated_velocity[i] = Velocity(v, last.inverse_mass);
    store_extrapolated_spin(i, spin + solver_state.beta * (spin - pass_spin_before_of(i)));
}
