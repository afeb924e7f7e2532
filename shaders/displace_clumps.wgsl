// twin: src/kernels/displace_clumps.rs
// Contact dynamics of clumps, the end of a step 2: centres and attitudes n to n + 1 with the velocities n + 1.
@compute @workgroup_size(WG)
fn displace_clumps(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    let here = clump(c);
    let push = pushed_on(here, gathered_by_clump(c, here.attitude));
    move_clump(c, here, clump_motion_next[c].v + push.v, clump_spin_next[c] + push.spin);
}
