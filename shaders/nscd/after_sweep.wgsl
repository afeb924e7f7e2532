// twin: src/nscd/after_sweep.rs
// Contact dynamics 3, coloured: velocities after all colours, and what the momentum of the next pass depends on; of
// clumps the residual alone, and `sync_members` does the rest.
var<storage, read_write> pass_residual: array<Real>;           // N, (m/s)²

fn after_sweep_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    var sums = ResidualSums();
    sums.residual_squared = pass_residual[i];
    pass_residual[i] = 0;
    sums.restart_criterion = respond_to_sweep(i);
    return sums;
}

@compute @workgroup_size(GROUP)
fn after_sweep(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    store_residual_sums(i / GROUP, i % GROUP, after_sweep_of(i));
}
