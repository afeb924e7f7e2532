// twin: src/kernels/probe.rs
// Contact dynamics, the step's length 2: a pass of the power iteration. Contacts turn velocities into the impulses that would
// undo them one by one, and these give the grains velocities.

fn probed(i: u32) -> Effort {
    let here = ahead[i];
    let spin = ahead_spin_of(i);
    let scale = 1 / max(relaxation.stretch, Real(1));
    var effort = Effort();
    var sum = Gathered();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        if ((entry & SPRUNG) == 0u) {
            continue;
        }
        let side = side_of(i, slot, entry & INDEX, here, spin);
        let j = entry & INDEX;
        var velocity = side.velocity;
        if (j >= params.bodies) {
            velocity += wall_velocity(j - params.bodies, place[i].x + lever[slot].own * side.n); // as if it stood
        }
        let approach = dot(velocity, side.n);
        let slip = velocity - approach * side.n;
        let mine = (side.turn * scale) * (approach / side.normal * side.n + slip * (1 / side.tangential));
        sum.force += mine;
        sum.torque += moment(lever[slot].own * meeting[slot].n, mine);
        effort.way += side.share * (approach * approach / side.normal + dot(slip, slip) / side.tangential);
    }
    effort.work = answer_probe(i, sum, here, spin);
    return effort;
}

@compute @workgroup_size(GROUP)
fn probe(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = linear(id, groups);
    of_lane[lane] = Effort();
    if (i < params.bodies) {
        of_lane[lane] = probed(i);
    }
    add_group(lane, i / GROUP);
}
