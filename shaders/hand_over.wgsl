// twin: src/kernels/hand_over.rs
// Contact dynamics of clumps 8: members hand over the impulses that the step ends with.
@compute @workgroup_size(WG)
fn hand_over(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.done, 1u);
    }
    var sum = Gathered();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let impulse = kept_spring(slot);
        let pressed = any(impulse != Vec());
        flag(slot, entry, pressed);
        if (pressed) {
            sum.force += impulse;
            sum.torque += moment(lever[slot].own * meeting[slot].n, impulse);
        }
    }
    hold(i, sum);
}
