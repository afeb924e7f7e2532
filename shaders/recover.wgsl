// twin: src/kernels/recover.rs
// Colours of clumps, after `gather`: the velocities of members freed of the rounding that the updates in place have left in them.
@compute @workgroup_size(WG)
fn recover(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let course = course_of(c, here);
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        settle(whereabouts[label], member_motion(here, course, label), course.spin);
    }
}
