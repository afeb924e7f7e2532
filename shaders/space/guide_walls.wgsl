// twin: src/space/guide_walls.rs
// Walls that move as the host says, n to n + 1, and those that a servo moves. In the plan only if a wall moves otherwise
// than with a velocity that never changes, or by a servo.
var<storage, read> wall_path: array<Wall>; // of all walls, after each step of the chunk
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn guide_walls(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let w = linear(gid, groups);
    // A step that has lost a body will be taken back.
    if (w >= params.walls || halt >= HALTED || atomicLoad(&counters.lost_body) > 0u) {
        return;
    }
    let now = wall[w];
    if (now.driven != 0u) {
        wall[w] = moved(now);
        return;
    }
    var next = wall_path[halt * params.walls + w];
    next.radius = now.radius;
    next.radius_low = now.radius_low;
    wall[w] = next;
}
