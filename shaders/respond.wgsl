// twin: src/kernels/respond.rs
// Contact dynamics of clumps, after `meet` and after a pass: clumps answer to the impulses that their members hold.
fn responded(c: u32) -> Effort {
    let here = clump(c);
    let course = course_of(c, here);
    spread(c, here, course);
    var slots = 0u;
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        slots += slot_start[i + 1u] - slot_start[i];
    }
    let free = clump_motion_next[c];
    // Blocks of W are at most twice their parts along and across n.
    let squared = metric(here, free.v, clump_spin_next[c]) * free.inverse_mass;
    var effort = reference(2u * slots, squared, free.inverse_mass);
    let start = course_ahead(c, here.attitude);
    effort.work = metric(here, course.v - start.v, course.spin - start.spin);
    return effort;
}

@compute @workgroup_size(GROUP)
fn respond(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let c = linear(id, groups);
    of_lane[lane] = Effort();
    if (c < params.clumps) {
        of_lane[lane] = responded(c);
    }
    add_group_of_clumps(lane, c / GROUP);
}
