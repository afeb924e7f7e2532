// twin: src/neighbours/history_count.rs
// History 1: how many contacts with a history each grain has.

@compute @workgroup_size(WG)
fn history_count(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i < params.bodies) {
        history_start[i] = active_contacts(i);
    } else if (i == params.bodies) {
        history_start[i] = 0u;
    }
}
