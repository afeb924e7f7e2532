// twin: src/nscd/residual.rs
// Contact dynamics 6: how far the impulses are from a solution, by the natural map, which anyone can compute again. A
// step is solved when every contact is, relative to what acts on it: a norm would not see a column that falls beside
// many grains at rest, or far from a fast one.
// Pairs that were left out and meet after all take part from now on.

/// More than this part of what acts on a contact is no rounding: loads that nothing balances grow from pass to pass.
const MOST_ROUNDING: Real = 1e-2;

fn residual_sums_of(i: u32, entries: vec2<u32>) -> ListSums {
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        let rigid = oriented_contact(i, entry, j, here, spin);
        let impulse = rigid.sign * impulse_of(entry);
        let compliance = compliance_of(pair_of(i, j), inverse_effective_mass[entry]);
        let side = compliant(rigid, compliance, impulse);
        if ((tagged & ACTIVE) == 0u && dot(side.velocity, side.n) > 0) {
            set_active(entry, tagged, true);
            total.sums.late_contacts++;
        }
        let error = natural_map(side, impulse, natural_map_scale(entry, side, compliance));
        var loads = load_speed[i];
        if (j < params.bodies) {
            loads += load_speed[j];
        }
        let scale = (contact_geometry[entry].speed + params.load_fraction * loads) + NO_SPEED;
        let size = sqrt(dot(error, error));
        total.sums.largest_residual = max(total.sums.largest_residual, size / scale);
        let rounding = select(Real(0), params.load_rounding * loads, size <= MOST_ROUNDING * contact_geometry[entry].speed);
        total.sums.resolved_residual = max(total.sums.resolved_residual, size / (scale + rounding));
        total.sums.reference += side.share * scale * scale;
        let normal_impulse = -dot(impulse, side.n);
        let friction = impulse + normal_impulse * side.n;
        total.sums.residual_squared += side.share * dot(error, error);
        total.sums.max_normal_impulse = max(total.sums.max_normal_impulse, normal_impulse);
        // In m/s, because squares of a small grain's impulses are beyond single precision.
        let across = side.tangential * friction;
        let excess = sqrt(dot(across, across)) / side.tangential - side.friction * normal_impulse;
        total.sums.coulomb_excess = max(total.sums.coulomb_excess, excess);
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn residual(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, residual_sums_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    store_residual_sums(walk.group, lane, total.sums);
}
