// twin: src/kernels/kick_clumps.rs
// Velocities of clumps and their members from time 0 to -1/2.

@compute @workgroup_size(WG)
fn kick_clumps(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let sum = contacts_of_clump(c, here.attitude);
    var w = here.spin;
    if (!spins_in_scene(here.inverse_moments)) {
        w = spun_back(w, spin_acceleration(here, w, own_torque(here, sum.torque)));
    } else if (here.motion.inverse_mass != 0) {
        w = spun_back(w, here.inverse_moments * sum.torque);
    }
    spin_gain[c] = 2 * (here.spin - w); // the step that the half step back is half of
    set_motion(c, here, kicked(here.motion, sum.force), w);
}
