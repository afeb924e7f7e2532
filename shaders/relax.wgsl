// twin: src/kernels/relax.rs
// Contact dynamics 3: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that momentum has
// carried ahead, and every grain gathers what its contacts do to it.

fn pass_of(i: u32) -> Effort {
    let here = ahead[i];
    let spin = ahead_spin_of(i);
    let step = 1 / (relaxation.shorter * relaxation.stretch);
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
        let old = side.turn * kept_spring(slot);
        let start = old + relaxation.beta * (old - side.turn * unpacked(spring_before[slot]));
        let next = relaxed(side, start, step);
        let mine = side.turn * next;
        spring_before[slot] = packed(mine);
        sum.force += mine;
        sum.torque += moment(lever[slot].own * meeting[slot].n, mine);
        let back = start - next;
        let on = next - old;
        let back_normal = dot(back, side.n);
        let on_normal = dot(on, side.n);
        let back_across = back - back_normal * side.n;
        let normal = side.normal * back_normal;
        let across = side.tangential * back_across;
        let far = natural_map(side, start, weight_of(slot, side.tangential));
        effort.residual += side.share * dot(far, far);
        effort.turn += side.share * (normal * on_normal + dot(across, on - on_normal * side.n));
        effort.way += side.share * (normal * back_normal + dot(across, back_across));
    }
    effort.work = answer_pass(i, sum, here, spin);
    return effort;
}

@compute @workgroup_size(GROUP)
fn relax(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = linear(id, groups);
    of_lane[lane] = Effort();
    if (i < params.bodies) {
        of_lane[lane] = pass_of(i);
    }
    add_group(lane, i / GROUP);
}
