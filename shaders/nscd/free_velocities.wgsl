// twin: src/nscd/free_velocities.rs
// Contact dynamics of clumps 0: velocities at the end of the step if nothing touched, of clumps and their members.
@compute @workgroup_size(WG)
fn free_velocities(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    var here = clump(c);
    let w = free_spin_of_clump(here);
    here.velocity = free_velocity(here.velocity);
    set_clump_velocity(c, here, here.velocity.v, w);
}
