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
    var w = here.spin;
    if (!spins_in_scene(here.inverse_moments)) {
        w = half_kick_spin(w, spin_acceleration(here, w, own_torque(here, sum.torque)));
    } else if (here.velocity.inverse_mass != 0) {
        w = half_kick_spin(w, here.inverse_moments * sum.torque);
    }
    spin_increment[c] = 2 * (here.spin - w); // the step that the half step back is half of
    set_clump_velocity(c, here, half_kick_velocity(here.velocity, sum.force), w);
}
