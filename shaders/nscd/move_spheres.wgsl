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
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let impulse = impulse_of(entry);
        set_active(entry, tagged, any(impulse != Vec()));
    }
    let here = position[i];
    let low = position_low_of(i);
    let v = pass_velocity[i].v;
    let point = wrap(displaced(here.x, low.x, params.dt * v));
    velocity_next[i] = Velocity(v, velocity[i].inverse_mass);
    store_spin(i, pass_spin_of(i));
    if (commit_position(i, here, low, point, params.dt * sqrt(dot(v, v)), false)) {
        atomicStore(&halt, 1u); // the host will take the step back, and walls must not have moved
    }
}
