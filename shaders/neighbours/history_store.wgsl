// twin: src/neighbours/history_store.rs
// History 2: what contacts remember, before the lists that hold it are made anew.

@compute @workgroup_size(WG)
fn history_store(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    // The host has made the history long enough; if it had not, histories would be lost, and counted as such.
    if (i < params.bodies && history_start[i + 1u] <= params.history) {
        store_history(i);
    }
}
