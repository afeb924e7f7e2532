// twin: src/nscd/move_clumps.rs
// Contact dynamics of clumps 9: centres and attitudes n to n + 1 with the velocities n + 1.
@compute @workgroup_size(WG)
fn move_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let pushed = impulse_response(c, here);
    let free = RigidVelocity(clump_velocity_next[c].v, clump_spin_next[c]); // since `free_velocities`
    move_clump(c, here, free.v + pushed.v, free.spin + pushed.spin);
}
