// twin: src/dem/half_kick_clumps.rs
// Velocities of clumps and their members from time 0 to -1/2.

@compute @workgroup_size(WG)
fn half_kick_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let sum = contacts_of_clump(c, here.orientation);
    var change = Spin();
    if (!spins_in_scene(here.inverse_moments)) {
        change = spin_change_back(here.spin, spin_acceleration(here, here.spin, own_torque(here, sum.torque)));
    } else if (here.velocity.inverse_mass != 0) {
        change = spin_change_back(here.spin, here.inverse_moments * sum.torque);
    }
    spin_increment[c] = -2 * change; // the step that the half step back is half of
    let low = clump_velocity_low_of(c);
    let v = accelerated(here.velocity.v, low.v, velocity_change_back(here.velocity, sum.force));
    set_clump_velocity(c, here, v, accelerated_spin(here.spin, low.spin, change));
}
