// twin: src/dem/advance.rs
// One step: contact forces at step n, gathered in ascending order of the other's id, then leapfrog with global damping,
// implicit at the half step: n - 1/2 to n + 1/2 (2.19), n to n + 1 (2.20). A step after which the lists may miss a
// neighbour, after which a grain is lost, or in which one overlaps deeply, is the last: it halts the steps that follow in
// the chunk. Large grains, which come last, have `advance_large`.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

// Many, whose grains are neighbours of each other: what one lane gets from memory is near for others.
const LANES = 256u;

@compute @workgroup_size(LANES)
fn advance(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = number_of(group, groups) * LANES + lane;
    if (halt >= HALTED) {
        if (i == 0u) {
            atomicMax(&halt_next, HALTED);
        }
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.steps_done, 1u);
        atomicMax(&halt_next, halt + 1u);
    }
    // A step without grains is one, too.
    if (i >= params.bodies - params.large) {
        return;
    }
    set_seed(params.step + halt);
    let here = body(i);
    let forces = body_forces(i, here);
    let deep = report_deep(forces.deep);
    if (leap(i, here, forces) || deep) {
        atomicMax(&halt_next, HALTED);
    }
}
