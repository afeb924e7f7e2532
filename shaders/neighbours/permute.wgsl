// twin: src/neighbours/permute.rs
// Grains into the order of the cells, so that neighbours are close in memory.
var<storage, read_write> id_next: array<u32>;    // N

@compute @workgroup_size(WG)
fn permute(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let old = sorted[i];
    let here = body(old);
    let point = requantised(here.position.x, here.low.x);
    position_next[i] = Position(point.x, here.position.radius);
    store_position_low(i, PositionLow(point.low, here.low.radius));
    velocity_next[i] = here.velocity;
    store_spin(i, here.spin);
    permute_velocity_low(i, old);
    id_next[i] = id[old];
    displacement[i] = 0;
    index_of_id[id[old]] = i;
}
