// twin: src/nscd/power_iteration_pass.rs
// Contact dynamics, the step's length 2: a pass of the power iteration. Contacts turn velocities into the impulses that
// would undo them one by one, and these give the grains velocities.

fn power_iteration_of(i: u32) -> ResidualSums {
    if (i >= params.bodies) {
        return ResidualSums();
    }
    let here = extrapolated_velocity[i];
    let spin = extrapolated_spin_of(i);
    let scale = 1 / max(solver_state.lipschitz, Real(1));
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
        let side = pushed_contact(i, entry, tagged & INDEX, here, spin);
        let approach = dot(side.velocity, side.n);
        let slip = side.velocity - approach * side.n;
        let mine = (side.sign * scale) * (approach / side.normal * side.n + slip * (1 / side.tangential));
        sum.force += mine;
        sum.torque += moment(inverse_effective_mass[entry].arm * contact_geometry[entry].n, mine);
        sums.step_squared += side.share * (approach * approach / side.normal + dot(slip, slip) / side.tangential);
    }
    sums.curvature = respond_to_power_iteration(i, sum, here, spin);
    return sums;
}

@compute @workgroup_size(GROUP)
fn power_iteration_pass(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    store_residual_sums(i, power_iteration_of(i));
}
