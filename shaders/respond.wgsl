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
    let unpushed = Course(free.v, clump_spin_next[c]);
    let squared = metric(here, unpushed, unpushed) * free.inverse_mass;
    var effort = reference(slots, squared, free.inverse_mass);
    let change = course_change(course_ahead(c, here.attitude), course);
    effort.work = metric(here, change, change);
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
