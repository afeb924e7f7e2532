// twin: src/kernels/integrate.rs
// Leapfrog with global damping, implicit at the half step: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20).
var<storage, read_write> place: array<Place>;        // N
var<storage, read_write> motion: array<Motion>;      // N
var<storage, read> force: array<Vec>;                // N
var<storage, read> place_before: array<Place>;       // N, when the lists were made
var<storage, read_write> counters: Counters;

@compute @workgroup_size(WG)
fn integrate(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let here = place[i];
    let inverse_mass = motion[i].inverse_mass;
    var v = motion[i].v;
    if (inverse_mass != 0) {
        let half = 0.5 * params.dt * params.damping;
        v = ((1 - half) * v + params.dt * (inverse_mass * force[i] + params.gravity)) / (1 + half);
    }
    let x = displace(i, here.x, params.dt * v);
    motion[i].v = v;
    place[i].x = x;
    integrate_spin(i, here, inverse_mass);
    if (outside(x, params.lower, params.upper)) {
        atomicMax(&counters.bad_body, params.bodies - i);
    }
    let moved = separation(place_before[i].x, x);
    if (!(dot(moved, moved) <= params.drift_limit * params.drift_limit)) {
        atomicStore(&counters.broken, 1u);
    }
}
