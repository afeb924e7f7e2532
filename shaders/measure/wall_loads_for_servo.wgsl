// twin: src/measure/wall_loads_for_servo.rs
// What `wall_loads` does, before every so many steps, for the walls that a servo moves.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn wall_loads_for_servo(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p < params.partial_sums_len && is_servo_due(halt)) {
        add_up_row(p, false);
    }
}
