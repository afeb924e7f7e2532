// twin: src/nscd/gather_impulses.rs
// Contact dynamics 5: velocities freed of the rounding that passes have left in them, and loads; members of clumps hold what
// `refresh_members` needs for that.

@compute @workgroup_size(WG)
fn gather_impulses(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    var impulse = Vec();
    var torque_impulse = Spin();
    var load = Real(0);
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        if ((tagged & ACTIVE) != 0u) {
            let mine = impulse_of(entry);
            impulse += mine;
            load += sqrt(dot(mine, mine));
            torque_impulse += moment(inverse_effective_mass[entry].arm * contact_geometry[entry].n, mine);
        }
    }
    respond_to_gather(i, ForceTorque(impulse, torque_impulse), load);
}
