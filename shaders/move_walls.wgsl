// twin: src/kernels/move_walls.rs
// Moving walls, n to n + 1. In the plan only if a wall moves.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn move_walls(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let w = linear(id, groups);
    if (w >= params.walls || halt != 0u) {
        return;
    }
    let point = moved(wall[w].point, wall[w].residue, params.dt * wall[w].velocity);
    wall[w].point = point.x;
    wall[w].residue = point.residue;
}
