// twin: src/neighbours/displacement_check.rs
// The end of a chunk: how far grains went, which tells the host how long lists may live, how far they are from the
// origin, and how many contacts the history must hold when they are made anew.
@compute @workgroup_size(WG)
fn displacement_check(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies || all_entries() > params.entries) {
        return;
    }
    // Floats that are not negative are ordered like their bits.
    let bits = bitcast<u32>(f32(displacement[i] / params.displacement_limit));
    if (bits > atomicLoad(&counters.max_displacement)) {
        atomicMax(&counters.max_displacement, bits);
    }
    let coordinate = bitcast<u32>(f32(largest_component(position[i].x) * params.inverse_quantum));
    if (coordinate > atomicLoad(&counters.max_coordinate)) {
        atomicMax(&counters.max_coordinate, coordinate);
    }
    let count = active_contacts(i);
    if (count != 0u) {
        atomicAdd(&counters.active_contacts, count);
    }
}
