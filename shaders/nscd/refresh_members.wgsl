// twin: src/nscd/refresh_members.rs
// Colors of clumps, after `gather_impulses`: the velocities of members freed of the rounding that the updates in place
// have left in them.
@compute @workgroup_size(WG)
fn refresh_members(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let velocity = clump_response_of(c, here);
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        remove_rounding(index_of_id[member_id], member_velocity(here, velocity, member_id), velocity.spin);
    }
}
