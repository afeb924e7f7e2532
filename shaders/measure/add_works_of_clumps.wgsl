// twin: src/measure/add_works_of_clumps.rs
// What free clumps add to the dissipation of their members in a step; it stands with the first of them.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn add_works_of_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps || halt >= HALTED) {
        return;
    }
    let own = energies_of_clump(c);
    let cell_power = flow_power(-own.flux, -own.flux_above);
    add_to_works(first_member[c], Works(own.dissipation, Real(0), Real(0), cell_power, Real(0)));
}
