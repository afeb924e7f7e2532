// twin: src/kernels/release.rs
// Contact dynamics of clumps 0: velocities at the end of the step if nothing touched, of clumps and their members.
@compute @workgroup_size(WG)
fn release(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    var here = clump(c);
    let w = free_spin_of_clump(here);
    here.motion = freed(here.motion);
    set_motion(c, here, here.motion.v, w);
}
