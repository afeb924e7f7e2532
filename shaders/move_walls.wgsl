// twin: src/kernels/move_walls.rs
// Moving walls, n to n + 1. In the plan only if a wall moves.
@compute @workgroup_size(WG)
fn move_walls(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let w = linear(id, groups);
    if (w >= params.walls) {
        return;
    }
    wall[w].point += params.dt * wall[w].velocity;
}
