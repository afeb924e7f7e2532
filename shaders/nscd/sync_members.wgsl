// twin: src/nscd/sync_members.rs
// Contact dynamics of clumps 3, coloured: members get the velocities that the sweeps have given the first of them, and
// what the momentum of the next pass depends on.
fn sync_members_of(c: u32) -> ResidualSums {
    if (c >= params.clumps) {
        return ResidualSums();
    }
    let here = clump(c);
    let q = here.orientation;
    let i = index_of_id[first_member[c]];
    let member_arm = arm_of(q, first_member[c]);
    var first = extrapolated_velocity[i];
    var now = extrapolated_clump(c, q);
    if (params.large != 0u) {
        // Contacts without a colour have left what they do with the members.
        let added = impulse_response(c, here);
        now = RigidVelocity(now.v + added.v, now.spin + added.spin);
        first.v += added.v + surface_velocity(added.spin, member_arm);
    }
    let last = from_first_member(c, q, pass_velocity[i], pass_spin[i]);
    let before = from_first_member(c, q, pass_velocity_before[i], pass_spin_before[i]);
    // From where the sweeps set out to where they led, along the change from the pass before.
    let change = velocity_difference(before, last);
    let start = RigidVelocity(last.v + solver_state.beta * change.v, last.spin + solver_state.beta * change.spin);
    var sums = ResidualSums();
    sums.restart_criterion = kinetic_metric(here, velocity_difference(now, start), velocity_difference(last, now));
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let member = index_of_id[member_id];
        let from_first = arm_of(q, member_id) - member_arm;
        pass_velocity_before[member] = Velocity(first.v + surface_velocity(now.spin, from_first), first.inverse_mass);
        pass_spin_before[member] = now.spin;
    }
    return sums;
}

@compute @workgroup_size(GROUP)
fn sync_members(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    store_clump_residual_sums(c, sync_members_of(c));
}
