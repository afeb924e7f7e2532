// twin: src/measure/add_works.rs
// A step's dissipation and works, before grains move: what is done from n - 1/2 to n + 1/2.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn add_works(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies || halt >= HALTED) {
        return;
    }
    let sum = with_body(PartialSums(), i);
    let cell_power = flow_power(sum.virial - sum.flux, sum.virial_above - sum.flux_above);
    add_to_works(id[i], Works(sum.dissipation, sum.wall_power, sum.fixed_power, cell_power, sum.growth_power));
}
