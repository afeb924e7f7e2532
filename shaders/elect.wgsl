// twin: src/kernels/elect.rs
// Colours of clumps, after `propose`: of the contacts that its members have named a clump keeps one, because contacts of a colour
// share no clump.
var<storage, read_write> proposal: array<u32>; // N

@compute @workgroup_size(WG)
fn elect(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps) {
        return;
    }
    var elected = NONE;
    var best = 0u;
    var ends = vec2<u32>();
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let j = proposal[i];
        if (j == NONE) {
            continue;
        }
        var other = j;
        if (j < params.bodies) {
            other = number[j];
        }
        let rank = lot(label, other);
        // Of equal ranks the last, as in `propose`, which goes through numbers: both clumps have to agree.
        let high = max(label, other);
        let low = min(label, other);
        let later = high > ends.x || (high == ends.x && low > ends.y);
        if (elected == NONE || rank > best || (rank == best && later)) {
            if (elected != NONE) {
                proposal[elected] = NONE;
            }
            elected = i;
            best = rank;
            ends = vec2<u32>(high, low);
        } else {
            proposal[i] = NONE;
        }
    }
}
