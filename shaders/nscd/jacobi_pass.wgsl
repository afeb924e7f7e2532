// twin: src/nscd/jacobi_pass.rs
// Contact dynamics 3: a pass. Every contact takes a step of Jacobi's kind from the impulses and velocities that
// momentum has carried ahead, and every grain gathers what its contacts do to it.

fn jacobi_pass_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    let step = step_of(solver_state);
    var sums = ResidualSums();
    var sum = ForceTorque();
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        if ((tagged & ACTIVE) == 0u) {
            continue;
        }
        let side = oriented_contact(i, entry, tagged & INDEX, here, spin);
        let old = side.sign * impulse_of(entry);
        let start = old + solver_state.beta * (old - side.sign * unpacked(impulse_before[entry]));
        let next = disc_update(side, start, step);
        let mine = side.sign * next;
        impulse_before[entry] = packed(mine);
        sum.force += mine;
        sum.torque += moment(inverse_effective_mass[entry].arm * contact_geometry[entry].n, mine);
        let back = start - next;
        let on = next - old;
        let error = natural_map(side, start, natural_map_scale(entry, side.tangential));
        sums.residual_squared += side.share * dot(error, error);
        sums.restart_criterion += side.share * scaled_product(side, back, on);
        sums.step_squared += side.share * scaled_product(side, back, back);
    }
    sums.curvature = respond_to_pass(i, sum, here, spin);
    return sums;
}

@compute @workgroup_size(GROUP)
fn jacobi_pass(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    store_residual_sums(i, jacobi_pass_of(i));
}
