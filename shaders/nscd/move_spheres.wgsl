// twin: src/nscd/move_spheres.rs
// Contact dynamics 8: the end of a step, positions n to n + 1 with the velocities n + 1.
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn move_spheres(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.steps_done, 1u);
    }
    var sum = ForceTorque();
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let impulse = impulse_of(entry);
        set_active(entry, tagged, any(impulse != Vec()));
        sum.force += impulse;
        sum.torque += moment(inverse_effective_mass[entry].arm * contact_geometry[entry].n, impulse);
    }
    let here = body(i);
    // From the impulses, and not from the velocities of the last pass, which have no digits for a small change.
    let inverse_mass = damping_factor() * here.velocity.inverse_mass;
    let change = free_velocity_change(here.velocity) + inverse_mass * sum.force;
    let spin_change =
        free_spin_change(here.velocity, here.spin) + inverse_inertia(here.position, inverse_mass) * sum.torque;
    let v = change_velocities(i, here, change, spin_change);
    let point = wrap(displaced(here.position.x, here.low.x, params.dt * v));
    if (commit_position(i, here.position, here.low, point, params.dt * sqrt(dot(v, v)), false)) {
        atomicMax(&halt, HALTED); // the host will take the step back, and walls must not have moved
    }
}
