// twin: src/measure/add_wall_loads.rs
// Sums of the rows that walls have, so few that the host may read them: part q of a wall adds up the rows q, q + parts,
// q + 2 parts, …
var<storage, read_write> wall_load: array<WallLoad>; // parts x walls

@compute @workgroup_size(WG)
fn add_wall_loads(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let part = linear(gid, groups);
    if (part >= WALL_PARTS * params.walls) {
        return;
    }
    var sum = WallLoad();
    for (var row = part; row < params.partial_sums_len * params.walls; row += WALL_PARTS * params.walls) {
        sum.force += wall_load_sums[row].force;
        sum.moment += wall_load_sums[row].moment;
        sum.normal_force += wall_load_sums[row].normal_force;
        sum.stiffness += wall_load_sums[row].stiffness;
    }
    wall_load[part] = sum;
}
