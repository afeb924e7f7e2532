// twin: src/nscd/free_velocities.rs
// Contact dynamics of clumps 0: velocities at the end of the step if nothing touched, of clumps and their members.
@compute @workgroup_size(WG)
fn free_velocities(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let change = free_spin_change_of_clump(here);
    count_iterations(change.rounds, change.settled);
    clump_velocity_next[c] = Velocity(free_velocity_change(here.velocity), damping_factor() * here.velocity.inverse_mass);
    clump_spin_next[c] = change.spin;
}
