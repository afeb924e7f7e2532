// twin: src/kernels/fall_in.rs
// Contact dynamics of clumps 3, coloured: members get the velocities that the sweeps have given the first of them, and what the
// momentum of the next pass depends on.
fn fallen_in(c: u32) -> Effort {
    let here = clump(c);
    let q = here.attitude;
    let i = whereabouts[first_member[c]];
    let now = course_ahead(c, q);
    let last = course_by(c, q, trial[i], trial_spin[i]);
    let before = course_by(c, q, trial_before[i], trial_spin_before[i]);
    // From where the sweeps set out to where they led, along the way from the pass before.
    let way = course_change(before, last);
    let start = Course(last.v + relaxation.beta * way.v, last.spin + relaxation.beta * way.spin);
    var effort = Effort();
    effort.turn = metric(here, course_change(now, start), course_change(last, now));
    let lead = arm_of(q, first_member[c]);
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let member = whereabouts[label];
        let from_first = arm_of(q, label) - lead;
        trial_before[member] = Motion(ahead[i].v + surface_velocity(now.spin, from_first), ahead[i].inverse_mass);
        trial_spin_before[member] = now.spin;
    }
    return effort;
}

@compute @workgroup_size(GROUP)
fn fall_in(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let c = linear(id, groups);
    of_lane[lane] = Effort();
    if (c < params.clumps) {
        of_lane[lane] = fallen_in(c);
    }
    add_group_of_clumps(lane, c / GROUP);
}
