// twin: src/nscd/coloring/resolve.rs
// Colors of clumps, after `propose`: of the contacts that its members have named a clump keeps one, because contacts of
// a colour share no clump.
var<storage, read_write> proposal: array<u32>; // N

@compute @workgroup_size(WG)
fn resolve(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps) {
        return;
    }
    var selected = NONE;
    var best = 0u;
    var ends = vec2<u32>();
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let j = proposal[i];
        if (j == NONE) {
            continue;
        }
        var other = j;
        if (j < params.bodies) {
            other = id[j];
        }
        let rank = priority(member_id, other);
        // Of equal ranks the last, as in `propose`, which goes through numbers: both clumps have to agree.
        let high = max(member_id, other);
        let low = min(member_id, other);
        let later = high > ends.x || (high == ends.x && low > ends.y);
        if (selected == NONE || rank > best || (rank == best && later)) {
            if (selected != NONE) {
                proposal[selected] = NONE;
            }
            selected = i;
            best = rank;
            ends = vec2<u32>(high, low);
        } else {
            proposal[i] = NONE;
        }
    }
}
