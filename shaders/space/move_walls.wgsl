// twin: src/space/move_walls.rs
// Moving walls, n to n + 1. In the plan only if a wall moves.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn move_walls(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let w = linear(gid, groups);
    // A step that has lost a body will be taken back.
    if (w >= params.walls || halt >= HALTED || atomicLoad(&counters.lost_body) > 0u) {
        return;
    }
    wall[w] = moved(wall[w]);
}
