// twin: src/kernels/echo.rs
// Contact dynamics of clumps, after a pass of the power iteration: the impulses that their members hold alone give clumps
// velocities.
fn echoed(c: u32) -> Effort {
    let here = clump(c);
    spread(c, here, push_of(c, here));
    var effort = Effort();
    let start = course_ahead(c, here.attitude);
    effort.work = metric(here, start, start);
    return effort;
}

@compute @workgroup_size(GROUP)
fn echo(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let c = linear(id, groups);
    of_lane[lane] = Effort();
    if (c < params.clumps) {
        of_lane[lane] = echoed(c);
    }
    add_group_of_clumps(lane, c / GROUP);
}
