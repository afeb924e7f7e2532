// twin: src/dem/place_members.rs
// A step of clumps 3: members follow from where their clumps are.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn place_members(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    if (halt >= HALTED) {
        if (i == 0u) {
            atomicMax(&halt_next, HALTED);
        }
        return;
    }
    if (place_member(i)) {
        atomicMax(&halt_next, HALTED);
    }
}
