// twin: src/kernels/half_kick.rs
// Velocities from time 0 to -1/2.
@compute @workgroup_size(WG)
fn half_kick(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = body(i);
    let sum = contacts_of(i, here);
    motion_next[i] = Motion(kicked(here.motion, sum.force), here.motion.inverse_mass);
    keep_spin(i, kicked_spin(here, sum.torque));
}
