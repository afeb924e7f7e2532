// twin: src/measure/synchronise_clumps.rs
// Velocities and spins of clumps and their members at the time of the positions, for people; the simulation goes on
// with those of the half step.

@compute @workgroup_size(WG)
fn synchronise_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let sum = contacts_of_clump(c, here.orientation);
    let low = clump_velocity_low_of(c);
    let v = accelerated(here.velocity.v, low.v, velocity_change_now(here.velocity, sum.force));
    set_clump_velocity(c, here, v, accelerated_spin(here.spin, low.spin, clump_spin_change_now(c, here, sum.torque)));
}
