// twin: src/kernels/load.rs
// A step of clumps 1: contact forces at step n on every member, gathered in ascending order of the other's id.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn load(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies || halt != 0u) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.done, 1u);
    }
    let pushed = pushed(i, body(i));
    pull[i] = pushed.sum.force;
    twist[i] = pushed.sum.torque;
    if (pushed.crossed) {
        atomicMax(&counters.bad_body, params.bodies - number[i]);
        atomicStore(&halt_next, 1u);
    }
}
