// twin: src/dem/member_forces.rs
// A step of clumps 1: contact forces at step n on every member, gathered in ascending order of the other's id.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn member_forces(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (halt >= HALTED) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.steps_done, 1u);
        atomicMax(&halt_next, halt + 1u);
    }
    // A step without grains is one, too.
    if (i >= params.bodies) {
        return;
    }
    set_seed(params.step + halt);
    let pushed = body_forces(i, body(i));
    member_force[i] = pushed.sum.force;
    member_torque[i] = pushed.sum.torque;
    if (pushed.crossed) {
        atomicMax(&counters.lost_body, params.bodies - id[i]);
    }
    if (report_deep(pushed.deep) || pushed.crossed) {
        atomicMax(&halt_next, HALTED);
    }
}
