// twin: src/kernels/follow.rs
// Contact dynamics 3, coloured: velocities after all colours, and what the momentum of the next pass depends on; of
// clumps the residual alone, and `fall_in` does the rest.
var<storage, read_write> miss: array<Real>;           // N, (m/s)²

fn followed(i: u32) -> Effort {
    var effort = Effort();
    effort.residual = miss[i];
    miss[i] = 0;
    effort.turn = answer_swept(i);
    return effort;
}

@compute @workgroup_size(GROUP)
fn follow(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let i = linear(id, groups);
    of_lane[lane] = Effort();
    if (i < params.bodies) {
        of_lane[lane] = followed(i);
    }
    add_group(lane, i / GROUP);
}
