// twin: src/nscd/setup_contacts.rs
// Contact dynamics 1: the contacts of a step, and the velocities that the impulses of the last step would give it.

/// Contacts of body i.
fn setup_contacts_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    let here = body(i);
    let free = free_motion(i);
    var sum = ForceTorque();
    var contacts = 0u;
    var sums = ResidualSums();
    let slack = params.dt * sqrt(dot(params.gravity, params.gravity));
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        var touch = Separation();
        var there = FreeMotion();
        if (j < params.bodies) {
            touch = sphere_separation_of(i, here, j);
            there = free_motion(j);
        } else {
            touch = wall_separation(j - params.bodies, here.position, here.low);
            there.v = wall_velocity(j - params.bodies, here.position.x + (here.position.radius + 0.5 * touch.gap) * touch.n);
            if (touch.gap < -here.position.radius) {
                atomicMax(&counters.lost_body, params.bodies - id[i]);
            }
        }
        let inverse_mass = inverse_effective_mass_of(entry, i, j, touch);
        inverse_effective_mass[entry] = inverse_mass;
        let bias_velocity = bias_velocity_of(touch.gap);
        // Both grains compute it from the first side, so that they agree.
        let arm = inverse_mass.arm * touch.n;
        let arm_to = -inverse_mass.arm_to * touch.n;
        var v = Vec();
        if (i < j) {
            v = past(free, arm, there, arm_to);
        } else {
            v = -past(there, arm_to, free, arm);
        }
        let speed = max(max(sqrt(dot(v, v)), -bias_velocity), slack);
        let q = v - bias_velocity * touch.n;
        free_contact_velocity[entry] = packed(q);
        contact_geometry[entry] = ContactGeometry(touch.n, speed);
        // Pairs that are not about to touch take no part in passes, unless the residual finds that they should.
        let is_active = (tagged & ACTIVE) != 0u || dot(q, touch.n) + slack >= 0;
        set_active(entry, tagged, is_active);
        contacts++;
        let old = warm_start_impulse(entry, tagged);
        if (is_active) {
            sums.reference += select(Real(1), Real(0.5), j < params.bodies) * speed * speed;
        }
        store_impulse(entry, old);
        impulse_before[entry] = packed(old);
        sum.force += old;
        sum.torque += moment(inverse_mass.arm * touch.n, old);
    }
    return combined(sums, respond_to_warm_start(i, sum, contacts));
}

@compute @workgroup_size(GROUP)
fn setup_contacts(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    store_residual_sums(i, setup_contacts_of(i));
}
