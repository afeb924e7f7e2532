// twin: src/dem/grow.rs
// Radii and masses, n to n + 1, once grains have moved: those at time 0 times what the host says of the step, so that no
// digit is lost over time. What grains grow by takes of the margin of their lists as a way does. In the plan only if radii
// change.
var<storage, read> start_size: array<StartSize>;   // N, by number
var<storage, read> growth_path: array<GrowthStep>; // of all materials, after each step of the chunk
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn grow(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (halt >= HALTED) {
        return;
    }
    let row = halt * params.materials;
    if (i < params.materials) {
        growth_rate_next[i] = growth_path[row + i].rate;
    }
    if (i >= params.bodies) {
        return;
    }
    let now = growth_path[row + material_of(i)];
    let start = start_size[id[i]];
    let radius = product_of(start.radius, start.radius_low, now.factor, now.factor_low);
    position_next[i] = Position(position_next[i].x, radius.value);
    store_radius_low(i, radius.low);
    velocity_next[i] = Velocity(velocity_next[i].v, start.inverse_mass * now.inverse_volume);
    let way = displacement[i] + max(radius.value - position[i].radius, Real(0));
    displacement[i] = way;
    if (!(way <= params.displacement_limit)) {
        atomicMax(&halt_next, HALTED);
    }
}
