// twin: src/measure/wall_loads_for_servo.rs
// What `wall_loads` does, before every so many steps, for the walls that a servo moves.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn wall_loads_for_servo(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    // They have been looked at already if the step was taken back, after which springs are those of now.
    let step = params.step + halt;
    let again = params.history_dt == 0 && step > 0u;
    if (p < params.partial_sums_len && halt < HALTED && !again && step % params.servo_steps == 0u) {
        add_up_row(p, false);
    }
}
