// twin: src/nscd/power_iteration_pass.rs
// Contact dynamics, the step's length 2: a pass of the power iteration. Contacts turn velocities into the impulses that
// would undo them one by one, and these give the grains velocities.

fn power_iteration_of(i: u32, entries: vec2<u32>) -> ListSums {
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    let scale = 1 / max(solver_state.lipschitz, Real(1));
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        if ((tagged & ACTIVE) == 0u) {
            continue;
        }
        let j = tagged & INDEX;
        let compliance = compliance_of(pair_of(i, j), inverse_effective_mass[entry]);
        let side = compliant(pushed_contact(i, entry, j, here, spin), compliance, Vec());
        let approach = dot(side.velocity, side.n);
        let slip = side.velocity - approach * side.n;
        let mine = (side.sign * scale) * (approach / side.normal * side.n + slip * (1 / side.tangential));
        total.impulse = with_impulse(total.impulse, entry, mine);
        let squared = approach * approach / side.normal + dot(slip, slip) / side.tangential;
        total.sums.step_squared += side.share * squared;
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn power_iteration_pass(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, power_iteration_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers) {
        let i = walk.body;
        let here = extrapolated_velocity[i];
        total.sums.curvature = respond_to_power_iteration(i, total.impulse, here, extrapolated_spin_of(i));
    }
    store_residual_sums(walk.group, lane, total.sums);
}
