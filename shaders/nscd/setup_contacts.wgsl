// twin: src/nscd/setup_contacts.rs
// Contact dynamics 1: the contacts of a step, and the velocities that the impulses of the last step would give it.

/// Contacts of body i.
fn setup_contacts_of(i: u32, entries: vec2<u32>) -> ListSums {
    let here = body(i);
    let free = free_motion(i);
    var total = ListSums();
    let slack = params.dt * sqrt(dot(params.gravity, params.gravity));
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        var smaller = here.position.radius;
        var touch = Separation();
        var there = FreeMotion();
        if (j < params.bodies) {
            touch = sphere_separation_of(i, here, j);
            there = free_motion(j);
            smaller = min(smaller, position[j].radius);
        } else {
            touch = wall_separation(j - params.bodies, here.position, here.low);
            there.v = wall_velocity(j - params.bodies, here.position.x + (here.position.radius + 0.5 * touch.gap) * touch.n);
            if (is_crossed(touch.gap, here.position.radius)) {
                atomicMax(&counters.lost_body, params.bodies - id[i]);
            }
        }
        if (is_deep(touch.gap, smaller)) {
            atomicMax(&counters.deep_overlaps, 1u);
        }
        let inverse_mass = inverse_effective_mass_of(entry, i, j, touch);
        inverse_effective_mass[entry] = inverse_mass;
        let pair = pair_of(i, j);
        let bias_velocity = bias_velocity_of(touch.gap, pair, inverse_mass);
        // Both grains compute it from the first side, so that they agree.
        let arm = inverse_mass.arm * touch.n;
        let arm_to = -inverse_mass.arm_to * touch.n;
        var v = Vec();
        if (j >= params.bodies) {
            v = past(free, arm, there, arm_to);
        } else if (i < j) {
            v = past_flow(past(free, arm, there, arm_to), arm - arm_to);
        } else {
            v = -past_flow(past(there, arm_to, free, arm), arm_to - arm);
        }
        let speed = max(max(sqrt(dot(v, v)), -bias_velocity), slack);
        let spring = spring_velocity(entry, tagged, touch.n, compliance_of(pair, inverse_mass));
        let q = (v - bias_velocity * touch.n) + spring;
        free_contact_velocity[entry] = packed(q);
        contact_geometry[entry] = ContactGeometry(touch.n, speed);
        // Pairs that are not about to touch take no part in passes, unless the residual finds that they should.
        let is_active = (tagged & ACTIVE) != 0u || dot(q, touch.n) + slack >= 0;
        set_active(entry, tagged, is_active);
        total.contacts++;
        let old = warm_start_impulse(entry, tagged);
        if (is_active) {
            total.sums.reference += select(Real(1), Real(0.5), j < params.bodies) * speed * speed;
        }
        store_impulse(entry, old);
        impulse_before[entry] = packed(old);
        total.impulse.force += old;
        total.impulse.torque += moment(inverse_mass.arm * touch.n, old);
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn setup_contacts(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, setup_contacts_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers) {
        total.sums = combined(total.sums, respond_to_warm_start(walk.body, total.impulse, total.contacts));
    }
    store_residual_sums(walk.group, lane, total.sums);
}
