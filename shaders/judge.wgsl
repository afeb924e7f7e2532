// twin: src/kernels/judge.rs
// Contact dynamics 6: how far the impulses are from a solution, by the natural map, which anyone can compute again. Pairs that
// were left out and meet after all take part from now on.

fn judged(i: u32) -> Effort {
    let here = ahead[i];
    let spin = ahead_spin_of(i);
    var effort = Effort();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let side = side_of(i, slot, entry & INDEX, here, spin);
        if ((entry & SPRUNG) == 0u && dot(side.velocity, side.n) > side.closing) {
            flag(slot, entry, true);
            effort.late++;
        }
        let impulse = side.turn * kept_spring(slot);
        let far = natural_map(side, impulse, weight_of(slot, side.tangential));
        let pressing = -dot(impulse, side.n);
        let friction = impulse + pressing * side.n;
        effort.residual += side.share * dot(far, far);
        effort.pressing = max(effort.pressing, pressing);
        // In m/s, because squares of a small grain's impulses are beyond single precision.
        let across = side.tangential * friction;
        effort.excess = max(effort.excess, sqrt(dot(across, across)) / side.tangential - side.friction * pressing);
    }
    return effort;
}

@compute @workgroup_size(GROUP)
fn judge(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = linear(id, groups);
    of_lane[lane] = Effort();
    if (i < params.bodies) {
        of_lane[lane] = judged(i);
    }
    add_group(lane, i / GROUP);
}
