// twin: src/kernels/follow.rs
// Contact dynamics 3, coloured: velocities after all colours, and what the momentum of the next pass depends on.
var<storage, read_write> miss: array<Real>;           // N, (m/s)²

fn followed(i: u32) -> Effort {
    var effort = Effort();
    effort.residual = miss[i];
    miss[i] = 0;
    // From where the sweeps set out to where they led, along the way from the pass before.
    let now = ahead[i];
    let last = trial[i].v;
    if (now.inverse_mass != 0) {
        let start = last + relaxation.beta * (last - trial_before[i].v);
        effort.turn = dot(start - now.v, now.v - last) / now.inverse_mass;
    }
    let spin = ahead_spin_of(i);
    let inertia = inverse_inertia(place[i], now.inverse_mass);
    if (inertia != 0) {
        let spin_last = trial_spin_of(i);
        let start = spin_last + relaxation.beta * (spin_last - trial_spin_before_of(i));
        effort.turn += spin_dot(start - spin, spin - spin_last) / inertia;
    }
    trial_before[i] = now;
    keep_trial_spin_before(i, spin);
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
