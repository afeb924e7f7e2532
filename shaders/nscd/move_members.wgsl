// twin: src/nscd/move_members.rs
// Contact dynamics of clumps 10: members follow from where their clumps are.
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn move_members(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i < params.bodies && place_member(i)) {
        atomicMax(&halt, HALTED); // the host will take the step back, and walls must not have moved
    }
}
