// twin: src/dem/half_kick.rs
// Velocities from time 0 to -1/2.
@compute @workgroup_size(WG)
fn half_kick(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = body(i);
    let sum = contacts_of(i, here);
    let spin_change = sphere_spin_change_back(here, sum.torque);
    change_velocities(i, here, velocity_change_back(here.velocity, sum.force), spin_change);
}
