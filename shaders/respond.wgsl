// twin: src/kernels/respond.rs
// Contact dynamics of clumps, after `meet` and after a pass: clumps answer to the impulses that their members hold.
var<storage, read_write> response: array<Motion>;    // N, m/s, 1/kg
var<storage, read_write> response_spin: array<Spin>; // N, rad/s

fn responded(c: u32) -> Effort {
    let here = clump(c);
    let push = pushed_on(here, gathered_by_clump(c, here.attitude));
    let free = clump_motion_next[c];
    let v = free.v + push.v;
    let w = clump_spin_next[c] + push.spin;
    var slots = 0u;
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        response[i] = Motion(v + surface_velocity(w, arm_of(here.attitude, label)), free.inverse_mass);
        response_spin[i] = w;
        slots += slot_start[i + 1u] - slot_start[i];
    }
    var effort = Effort();
    effort.crowd = Real(2u * slots); // blocks of W are at most twice their parts along and across n
    if (free.inverse_mass != 0) {
        let start = course_ahead(c, here.attitude);
        effort.work = metric(here, v - start.v, w - start.spin);
        effort.reference = dot(free.v, free.v);
        effort.least = params.dt * params.dt * dot(params.gravity, params.gravity);
    }
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
