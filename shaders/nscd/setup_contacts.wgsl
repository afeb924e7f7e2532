// twin: src/nscd/setup_contacts.rs
// Contact dynamics 1: the contacts of a step, and the velocities that the impulses of the last step would give it.

/// Contacts of body i.
fn setup_contacts_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    let here = body(i);
    let free = free_velocity_of(i);
    var sum = ForceTorque();
    var contacts = 0u;
    var sums = ResidualSums();
    let slack = params.dt * sqrt(dot(params.gravity, params.gravity));
    let rim_speed = here.position.radius * sqrt(spin_squared(here.spin));
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        var touch = Separation();
        var there = Velocity();
        if (j < params.bodies) {
            touch = sphere_separation_of(i, here, j);
            there = free_velocity_of(j);
        } else {
            touch = wall_separation(j - params.bodies, here.position, here.low);
            there.v = wall_velocity(j - params.bodies, here.position.x);
            if (touch.gap < -here.position.radius) {
                atomicMax(&counters.lost_body, params.bodies - id[i]);
            }
        }
        let inverse_mass = inverse_effective_mass_of(entry, i, j, free, there, touch);
        inverse_effective_mass[entry] = inverse_mass;
        let bias_velocity = bias_velocity_of(touch.gap);
        // Pairs that are not about to touch take no part in passes, unless the residual finds that they should. Both
        // grains compute that from the first side, so that they agree.
        let first = i < j;
        let v = select(there.v, free.v, first) - select(free.v, there.v, first);
        let is_active = (tagged & ACTIVE) != 0u || bias_velocity <= dot(v, select(-touch.n, touch.n, first)) + slack;
        set_active(entry, tagged, is_active);
        contacts++;
        if (is_active) {
            let imposed = select(Vec(), there.v, there.inverse_mass == 0);
            let speed = max(max(sqrt(dot(imposed, imposed)), rim_speed), -bias_velocity);
            sums.imposed_speed = max(sums.imposed_speed, speed);
        }
        contact_geometry[entry] = ContactGeometry(touch.n, bias_velocity);
        let old = warm_start_impulse(entry, tagged);
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
