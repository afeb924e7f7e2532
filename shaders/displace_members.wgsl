// twin: src/kernels/displace_members.rs
// Contact dynamics of clumps 10: members follow from where their clumps are.
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn displace_members(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i < params.bodies && follow_clump(i)) {
        atomicStore(&halt, 1u); // the host will take the step back, and walls must not have moved
    }
}
