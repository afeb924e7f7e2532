// twin: src/kernels/gather.rs
// Colours 5: velocities freed of the rounding that the updates in place have left in them; members of clumps hold what `recover`
// needs for that.

@compute @workgroup_size(WG)
fn gather(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    var impulse = Vec();
    var twist = Spin();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        if ((entry & SPRUNG) != 0u) {
            let mine = kept_spring(slot);
            impulse += mine;
            twist += moment(lever[slot].own * meeting[slot].n, mine);
        }
    }
    answer_gathered(i, Gathered(impulse, twist));
}
