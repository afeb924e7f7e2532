// twin: src/nscd/free_velocities.rs
// Contact dynamics of clumps 0: velocities at the end of the step if nothing touched, of clumps and their members.
@compute @workgroup_size(WG)
fn free_velocities(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    var here = clump(c);
    let change = free_spin_change_of_clump(here);
    count_iterations(change.rounds, change.settled);
    here.velocity = free_velocity(here.velocity);
    let spin = SplitSpin(here.spin + change.spin, vec2<u32>());
    set_clump_velocity(c, here, SplitVelocity(here.velocity.v, vec2<u32>()), spin);
}
