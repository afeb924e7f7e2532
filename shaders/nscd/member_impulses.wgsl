// twin: src/nscd/member_impulses.rs
// Contact dynamics of clumps 8: members hand over the impulses that the step ends with.
@compute @workgroup_size(WG)
fn member_impulses(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
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
        let pressed = any(impulse != Vec());
        set_active(entry, tagged, pressed);
        if (pressed) {
            sum.force += impulse;
            sum.torque += moment(inverse_effective_mass[entry].arm * contact_geometry[entry].n, impulse);
        }
    }
    store_member_load(i, sum);
}
