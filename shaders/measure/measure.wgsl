// twin: src/measure/measure.rs
// Sums over free grains at step n, in an order that no sorting changes: row p adds up the grains with the numbers p, p +
// parts, p + 2 parts, …
@compute @workgroup_size(WG)
fn measure(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len) {
        return;
    }
    var sum = PartialSums();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        sum = with_body(sum, index_of_id[number]);
    }
    partial_sums[p] = sum;
}
