// twin: src/nscd/power_iteration_start.rs
// Contact dynamics, the step's length 1: velocities that hide from no mode, for a power iteration.
@compute @workgroup_size(WG)
fn power_iteration_start(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        solver_state.lipschitz = 0;
        solver_state.beta = 0;
    }
    let inverse_mass = impulse_inverse_mass(i);
    var v = Vec();
    if (inverse_mass != 0) {
        // One of two directions along every axis, by the bits of a scrambled number.
        var bits = (grain_of(i) + 1u) * 2654435769u;
        bits = (bits ^ (bits >> 15u)) * 2246822519u;
        bits = bits ^ (bits >> 13u);
        for (var axis = 0u; axis < DIMENSIONS; axis++) {
            v[axis] = select(Real(-1), Real(1), ((bits >> axis) & 1u) == 0u);
        }
    }
    extrapolated_velocity[i] = Velocity(v, inverse_mass);
    store_extrapolated_spin(i, Spin());
}
