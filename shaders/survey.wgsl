// twin: src/kernels/survey.rs
// The end of a chunk: how far grains went, which tells the host how long lists may live, and how many springs the
// history must hold when they are made anew.
@compute @workgroup_size(WG)
fn survey(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies || slot_start[params.bodies] > params.slots) {
        return;
    }
    let bits = bitcast<u32>(f32(travel[i] / params.drift_limit)); // non-negative floats are ordered like their bits
    if (bits > atomicLoad(&counters.drift)) {
        atomicMax(&counters.drift, bits);
    }
    let springs = springs_kept(i);
    if (springs != 0u) {
        atomicAdd(&counters.springs, springs);
    }
}
