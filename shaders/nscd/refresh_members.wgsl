// twin: src/nscd/refresh_members.rs
// Contact dynamics of clumps, after `gather_impulses`: the velocities of members freed of the rounding that passes have
// left in them, and the loads of the whole clump.
@compute @workgroup_size(WG)
fn refresh_members(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let velocity = impulse_response(c, here);
    var loads = Real(0);
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        loads += load_speed[index_of_id[member_id]];
    }
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        remove_rounding(index_of_id[member_id], member_velocity(here, velocity, member_id), velocity.spin);
        load_speed[index_of_id[member_id]] = loads;
    }
}
