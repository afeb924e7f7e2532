// twin: src/kernels/synchronise.rs
// Velocities and spins at the time of the positions, for people; the simulation goes on with those of the half step.
@compute @workgroup_size(WG)
fn synchronise(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = body(i);
    let sum = contacts_of(i, here);
    motion_next[i] = Motion(velocity_now(here.motion, sum.force), here.motion.inverse_mass);
    keep_spin(i, spin_now(here, sum.torque));
}
