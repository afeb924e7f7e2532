// twin: src/kernels/relax.rs
// Contact dynamics 3: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that momentum has
// carried ahead, and every grain gathers what its contacts do to it.
var<storage, read_write> trial_before: array<Motion>; // N, m/s, 1/kg: written anew

fn pass_of(i: u32) -> Effort {
    let here = ahead[i];
    let spin = ahead_spin_of(i);
    let step = 1 / relaxation.stretch;
    var effort = Effort();
    var impulse = Vec();
    var twist = Spin();
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
        impulse += mine;
        twist += moment(lever[slot].own * meeting[slot].n, mine);
        let back = start - next;
        let on = next - old;
        let back_normal = dot(back, side.n);
        let on_normal = dot(on, side.n);
        let back_across = back - back_normal * side.n;
        let normal = side.normal * back_normal;
        let across = side.tangential * back_across;
        let far = natural_map(side, start);
        effort.residual += side.share * dot(far, far);
        effort.turn += side.share * (normal * on_normal + dot(across, on - on_normal * side.n));
        effort.way += side.share * (normal * back_normal + dot(across, back_across));
    }
    let free = freed(motion[i]);
    let inertia = inverse_inertia(place[i], free.inverse_mass);
    let v = free.v + free.inverse_mass * impulse;
    let turned = freed_spin(motion[i], spin_of(i)) + inertia * twist;
    trial_before[i] = Motion(v, free.inverse_mass);
    keep_trial_spin_before(i, turned);
    if (free.inverse_mass != 0) {
        effort.work = dot(v - here.v, v - here.v) / free.inverse_mass;
    }
    if (inertia != 0) {
        effort.work += spin_squared(turned - spin) / inertia;
    }
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
