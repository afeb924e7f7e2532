// twin: src/nscd/clump_response.rs
// Contact dynamics of clumps, after `setup_contacts` and after a pass: clumps answer to the impulses that their members
// hold.
fn respond_to_members(c: u32) -> ResidualSums {
    if (c >= params.clumps) {
        return ResidualSums();
    }
    let here = clump(c);
    let velocity = impulse_response(c, here);
    set_member_velocities(c, here, velocity);
    var entries = 0u;
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let list = list_of(i);
        for (var entry = list.begin; entry < list.end && neighbour[entry] != NONE; entry += list.step) {
            entries++;
        }
    }
    var sums = ResidualSums();
    sums.lipschitz_bound = Real(entries);
    let change = velocity_difference(extrapolated_clump(c, here.orientation), velocity);
    sums.curvature = kinetic_metric(here, change, change);
    return sums;
}

@compute @workgroup_size(GROUP)
fn clump_response(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    store_clump_residual_sums(c, respond_to_members(c));
}
