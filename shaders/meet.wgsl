// twin: src/kernels/meet.rs
// Contact dynamics 1: the contacts of a step, and the velocities that the impulses of the last step would give it.
var<storage, read_write> trial: array<Motion>;        // N, m/s, 1/kg: after the last pass
var<storage, read_write> trial_before: array<Motion>; // N: after the pass before

/// Contacts of grain i; its free velocity, squared, is what residuals are relative to.
fn met(i: u32) -> Effort {
    let here = body(i);
    let free = freed(here.motion);
    let inertia = inverse_inertia(here.place, free.inverse_mass);
    var impulse = Vec();
    var twist = Spin();
    var effort = Effort();
    let slack = params.dt * sqrt(dot(params.gravity, params.gravity));
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let j = entry & INDEX;
        var touch = Touch();
        var l = Lever();
        var velocity_to = Vec();
        if (j < params.bodies) {
            touch = meet_grain(i, here, j);
            l.other = place[j].radius + 0.5 * touch.gap;
            let there = freed(motion[j]);
            velocity_to = there.v;
            l.normal = free.inverse_mass + there.inverse_mass;
            l.tangential = l.other * l.other * inverse_inertia(place[j], there.inverse_mass);
        } else {
            touch = touch_wall(j - params.bodies, here.place, here.residue);
            l.normal = free.inverse_mass;
            velocity_to = wall_velocity(j - params.bodies, here.place.x);
            if (touch.gap < -here.place.radius) {
                atomicMax(&counters.bad_body, params.bodies - number[i]);
            }
        }
        l.own = here.place.radius + 0.5 * touch.gap;
        l.tangential = l.normal + (l.tangential + l.own * l.own * inertia);
        let closing = closing_of(touch.gap);
        // Pairs that are not about to touch take no part in passes, unless the judgement finds that they should. Both grains
        // compute that from the first side, so that they agree.
        let first = i < j;
        let v = select(velocity_to, free.v, first) - select(free.v, velocity_to, first);
        let part = (entry & SPRUNG) != 0u || closing <= dot(v, select(-touch.n, touch.n, first)) + slack;
        flag(slot, entry, part);
        effort.crowd += 1;
        if (part) {
            let wall = select(Vec(), velocity_to, j >= params.bodies);
            effort.imposed = max(effort.imposed, max(sqrt(dot(wall, wall)), -closing));
        }
        meeting[slot] = Meeting(touch.n, closing);
        lever[slot] = l;
        let old = spring_of(slot, entry);
        keep_spring(slot, old);
        spring_before[slot] = packed(old);
        impulse += old;
        twist += moment(l.own * touch.n, old);
    }
    let start = Motion(free.v + free.inverse_mass * impulse, free.inverse_mass);
    let spin = freed_spin(here.motion, here.spin) + inertia * twist;
    trial[i] = start;
    trial_before[i] = start;
    ahead[i] = start;
    keep_trial_spin(i, spin);
    keep_trial_spin_before(i, spin);
    keep_ahead_spin(i, spin);
    if (free.inverse_mass != 0) {
        effort.reference = dot(free.v, free.v);
        effort.least = slack * slack;
    }
    return effort;
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
