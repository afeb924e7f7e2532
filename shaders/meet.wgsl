// twin: src/kernels/meet.rs
// Contact dynamics 1: the contacts of a step, and the velocities that the impulses of the last step would give it.

/// Contacts of body i.
fn met(i: u32) -> Effort {
    let here = body(i);
    let free = free_motion(i);
    var sum = Gathered();
    var contacts = 0u;
    var effort = Effort();
    let slack = params.dt * sqrt(dot(params.gravity, params.gravity));
    let rim = here.place.radius * sqrt(spin_squared(here.spin));
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let j = entry & INDEX;
        var touch = Touch();
        var there = Motion();
        if (j < params.bodies) {
            touch = meet_grain(i, here, j);
            there = free_motion(j);
        } else {
            touch = touch_wall(j - params.bodies, here.place, here.residue);
            there.v = wall_velocity(j - params.bodies, here.place.x);
            if (touch.gap < -here.place.radius) {
                atomicMax(&counters.bad_body, params.bodies - number[i]);
            }
        }
        let l = lever_of(slot, i, j, free, there, touch);
        lever[slot] = l;
        let closing = closing_of(touch.gap);
        // Pairs that are not about to touch take no part in passes, unless the judgement finds that they should. Both grains
        // compute that from the first side, so that they agree.
        let first = i < j;
        let v = select(there.v, free.v, first) - select(free.v, there.v, first);
        let part = (entry & SPRUNG) != 0u || closing <= dot(v, select(-touch.n, touch.n, first)) + slack;
        flag(slot, entry, part);
        contacts++;
        if (part) {
            let imposed = select(Vec(), there.v, there.inverse_mass == 0);
            effort.imposed = max(effort.imposed, max(max(sqrt(dot(imposed, imposed)), rim), -closing));
        }
        meeting[slot] = Meeting(touch.n, closing);
        let old = spring_of(slot, entry);
        keep_spring(slot, old);
        spring_before[slot] = packed(old);
        sum.force += old;
        sum.torque += moment(l.own * touch.n, old);
    }
    return combined(effort, answer_first(i, sum, contacts));
}

@compute @workgroup_size(GROUP)
fn meet(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = linear(id, groups);
    of_lane[lane] = Effort();
    if (i < params.bodies) {
        of_lane[lane] = met(i);
    }
    add_group(lane, i / GROUP);
}
