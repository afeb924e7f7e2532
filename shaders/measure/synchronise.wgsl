// twin: src/measure/synchronise.rs
// Velocities and spins at the time of the positions, for people; the simulation goes on with those of the half step.
@compute @workgroup_size(WG)
fn synchronise(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = body(i);
    let sum = contacts_of(i, here);
    change_velocities(i, here, velocity_change_now(here.velocity, sum.force), spin_change_now(here, sum.torque));
}
