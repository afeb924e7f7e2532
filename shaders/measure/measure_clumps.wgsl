// twin: src/measure/measure_clumps.rs
// What free clumps add to the sums over their members, in the same order: row p has clumps p, p + parts, p + 2 parts, …

@compute @workgroup_size(WG)
fn measure_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len) {
        return;
    }
    var sum = partial_sums[p];
    for (var c = p; c < params.clumps; c += params.partial_sums_len) {
        let own = energies_of_clump(c);
        sum.kinetic += own.kinetic;
        sum.potential += own.potential;
        sum.net_force += own.net_force;
        sum.dissipation += own.dissipation;
        sum.flux += own.flux;
        sum.flux_above += own.flux_above;
    }
    partial_sums[p] = sum;
}
