// twin: src/dem/measure_gain.rs
// Adaptive damping 1: what all forces of the step do to free grains, which is what their kinetic energy of translation grows
// by. Row p adds up the grains with the numbers p, p + rows, p + 2 rows, …
var<storage, read> halt: u32;
var<storage, read_write> energy_gain: array<Real>; // rows of the measurement, J

@compute @workgroup_size(WG)
fn measure_gain(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len || halt >= HALTED) {
        return;
    }
    var sum = Real();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        let i = index_of_id[number];
        let before = velocity[i];
        if (before.inverse_mass > 0) {
            let v = velocity_next[i].v;
            sum += 0.5 * dot(v - before.v, v + before.v) / before.inverse_mass;
        }
    }
    energy_gain[p] = sum;
}
