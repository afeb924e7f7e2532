// twin: src/kernels/drift.rs
// How far grains moved in this chunk: the host chooses the length of the next one by it.
var<storage, read> place: array<Place>;              // N
var<storage, read> place_before: array<Place>;       // N
var<storage, read_write> counters: Counters;

@compute @workgroup_size(WG)
fn drift(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let moved = separation(place_before[i].x, place[i].x) / params.drift_limit;
    let bits = bitcast<u32>(f32(dot(moved, moved))); // non-negative floats are ordered like their bits
    if (bits > atomicLoad(&counters.drift)) {
        atomicMax(&counters.drift, bits);
    }
}
