// twin: src/nscd/jacobi_pass.rs
// Contact dynamics 3: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that
// momentum has carried ahead, and every grain gathers what its contacts do to it.

fn jacobi_pass_of(i: u32, entries: vec2<u32>) -> ListSums {
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    let step = step_of(solver_state);
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
        let rigid = oriented_contact(i, entry, j, here, spin);
        let old = rigid.sign * impulse_of(entry);
        let start = old + solver_state.beta * (old - rigid.sign * unpacked(impulse_before[entry]));
        let compliance = compliance_of(pair_of(i, j), inverse_effective_mass[entry]);
        let side = compliant(rigid, compliance, start);
        let next = disc_update(side, start, step);
        let mine = side.sign * next;
        impulse_before[entry] = packed(mine);
        total.impulse = with_impulse(total.impulse, entry, mine);
        let back = start - next;
        let on = next - old;
        let error = natural_map(side, start, natural_map_scale(entry, side, compliance));
        total.sums.residual_squared += side.share * dot(error, error);
        total.sums.restart_criterion += side.share * scaled_product(side, back, on);
        total.sums.step_squared += side.share * scaled_product(side, back, back);
        total.sums.curvature += side.share * compliant_work(side.n, compliance, back);
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn jacobi_pass(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, jacobi_pass_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers) {
        let i = walk.body;
        total.sums.curvature += respond_to_pass(i, total.impulse, extrapolated_velocity[i], extrapolated_spin_of(i));
    }
    store_residual_sums(walk.group, lane, total.sums);
}
