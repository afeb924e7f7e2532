// twin: src/nscd/power_iteration_clumps.rs
// Contact dynamics of clumps, after a pass of the power iteration: the impulses that their members hold alone give
// clumps velocities.
fn power_iteration_of_clump(c: u32) -> ResidualSums {
    if (c >= params.clumps) {
        return ResidualSums();
    }
    let here = clump(c);
    set_member_velocities(c, here, impulse_response(c, here));
    var sums = ResidualSums();
    let start = extrapolated_clump(c, here.orientation);
    sums.curvature = kinetic_metric(here, start, start);
    return sums;
}

@compute @workgroup_size(GROUP)
fn power_iteration_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    store_clump_residual_sums(c, power_iteration_of_clump(c));
}
