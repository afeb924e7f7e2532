// twin: src/nscd/residual.rs
// Contact dynamics 6: how far the impulses are from a solution, by the natural map, which anyone can compute again. A
// step is solved when every contact is, relative to what acts on it: a norm would not see a column that falls beside
// many grains at rest, or far from a fast one.
// Pairs that were left out and meet after all take part from now on.

/// More than this part of what acts on a contact is no rounding: loads that nothing balances grow from pass to pass.
const MOST_ROUNDING: Real = 1e-2;

fn residual_sums_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    var sums = ResidualSums();
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        let side = oriented_contact(i, entry, j, here, spin);
        if ((tagged & ACTIVE) == 0u && dot(side.velocity, side.n) > 0) {
            set_active(entry, tagged, true);
            sums.late_contacts++;
        }
        let impulse = side.sign * impulse_of(entry);
        let error = natural_map(side, impulse, natural_map_scale(entry, side.tangential));
        var loads = load_speed[i];
        if (j < params.bodies) {
            loads += load_speed[j];
        }
        let scale = (contact_geometry[entry].speed + params.load_fraction * loads) + NO_SPEED;
        let size = sqrt(dot(error, error));
        sums.largest_residual = max(sums.largest_residual, size / scale);
        let rounding = select(Real(0), params.load_rounding * loads, size <= MOST_ROUNDING * contact_geometry[entry].speed);
        sums.resolved_residual = max(sums.resolved_residual, size / (scale + rounding));
        sums.reference += side.share * scale * scale;
        let normal_impulse = -dot(impulse, side.n);
        let friction = impulse + normal_impulse * side.n;
        sums.residual_squared += side.share * dot(error, error);
        sums.max_normal_impulse = max(sums.max_normal_impulse, normal_impulse);
        // In m/s, because squares of a small grain's impulses are beyond single precision.
        let across = side.tangential * friction;
        let excess = sqrt(dot(across, across)) / side.tangential - side.friction * normal_impulse;
        sums.coulomb_excess = max(sums.coulomb_excess, excess);
    }
    return sums;
}

@compute @workgroup_size(GROUP)
fn residual(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    store_residual_sums(i, residual_sums_of(i));
}
