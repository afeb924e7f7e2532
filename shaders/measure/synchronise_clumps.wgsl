// twin: src/measure/synchronise_clumps.rs
// Velocities and spins of clumps and their members at the time of the positions, for people; the simulation goes on
// with those of the half step.

@compute @workgroup_size(WG)
fn synchronise_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let sum = contacts_of_clump(c, here.orientation);
    set_clump_velocity(c, here, velocity_now(here.velocity, sum.force), spin_of_clump_now(c, here, sum.torque));
}
