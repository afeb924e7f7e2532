// twin: src/kernels/gather.rs
// Colours 5: velocities freed of the rounding that the updates in place have left in them.

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
    let now = answer(i, Gathered(impulse, twist));
    let off = now.motion.v - trial[i].v;
    let spin_off = now.spin - trial_spin_of(i);
    trial[i] = Motion(trial[i].v + off, now.motion.inverse_mass);
    trial_before[i] = Motion(trial_before[i].v + off, now.motion.inverse_mass);
    ahead[i] = Motion(ahead[i].v + off, now.motion.inverse_mass);
    keep_trial_spin(i, trial_spin_of(i) + spin_off);
    keep_trial_spin_before(i, trial_spin_before_of(i) + spin_off);
    keep_ahead_spin(i, ahead_spin_of(i) + spin_off);
}
