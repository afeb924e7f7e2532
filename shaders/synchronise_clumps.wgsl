// twin: src/kernels/synchronise_clumps.rs
// Velocities and spins of clumps and their members at the time of the positions, for people; the simulation goes on with those of
// the half step.

@compute @workgroup_size(WG)
fn synchronise_clumps(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let sum = contacts_of_clump(c, here.attitude);
    set_motion(c, here, velocity_now(here.motion, sum.force), spin_of_clump_now(c, here, sum.torque));
}
