// twin: src/measure/measure_for_servo.rs
// What `measure` does, before every so many steps, for the servo of the cell.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn measure_for_servo(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len || !is_servo_due(halt)) {
        return;
    }
    var sum = PartialSums();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        sum = with_body(sum, index_of_id[number]);
    }
    partial_sums[p] = sum;
}
