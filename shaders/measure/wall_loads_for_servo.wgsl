// twin: src/measure/wall_loads_for_servo.rs
// What `wall_loads` does, before every so many steps, for the walls that a servo moves.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn wall_loads_for_servo(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(gid, groups);
    let rows = params.partial_sums_len * params.walls;
    if (k >= rows || halt >= HALTED || (params.step + halt) % params.servo_steps != 0u) {
        return;
    }
    var load = WallLoad();
    if (wall[k % params.walls].driven != 0u) {
        load = wall_loads_of_row(k);
    }
    wall_load_sums[k] = load;
}
