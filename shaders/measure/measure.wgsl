// twin: src/measure/measure.rs
// Sums over free grains at step n, in an order that no sorting changes: row p adds up the grains with the numbers p, p +
// parts, p + 2 parts, …
@compute @workgroup_size(WG)
fn measure(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len) {
        return;
    }
    partial_sums[p] = PartialSums();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        let more = sums_of_body(index_of_id[number]);
        partial_sums[p] = sum_of(partial_sums[p], more); // in memory, because a body needs all registers there are
    }
}
