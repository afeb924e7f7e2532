// twin: src/kernels/half_kick.rs
// Velocities from time 0 to -1/2: v0 - dt/2 a0, without which the leapfrog loses an order of accuracy.
var<storage, read> place: array<Place>;              // N
var<storage, read_write> motion: array<Motion>;      // N
var<storage, read> force: array<Vec>;                // N

@compute @workgroup_size(WG)
fn half_kick(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let inverse_mass = motion[i].inverse_mass;
    if (inverse_mass != 0) {
        let acceleration = inverse_mass * force[i] + params.gravity - params.damping * motion[i].v;
        motion[i].v -= 0.5 * params.dt * acceleration;
    }
    half_kick_spin(i, place[i], inverse_mass);
}
