// twin: src/kernels/advance.rs
// One step: contact forces at step n, gathered in ascending order of the other's id, then leapfrog with global damping,
// implicit at the half step: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20). A step after which the lists may miss a
// neighbour, or after which a grain is lost, is the last: it halts the steps that follow in the chunk.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn advance(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (halt != 0u) {
        if (i == 0u) {
            atomicStore(&halt_next, 1u);
        }
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.done, 1u);
    }
    let here = body(i);
    let pushed = pushed(i, here);
    let v = advanced(here.motion, pushed.sum.force);
    let point = wrapped(moved(here.place.x, here.residue.x, params.dt * v));
    motion_next[i] = Motion(v, here.motion.inverse_mass);
    keep_spin(i, advanced_spin(here, pushed.sum.torque));
    if (arrive(i, here.place, here.residue, point, params.dt * sqrt(dot(v, v)), pushed.crossed)) {
        atomicStore(&halt_next, 1u);
    }
}
