// twin: src/measure/energies.rs
// Energies of clumps: a member has none by itself.

/// Nothing: a member has no energy by itself, see `measure_clumps`.
fn energies(here: Body, sum: ForceTorque, drag: ForceTorque) -> Energies {
    return Energies();
}

/// J, of a free clump that spins so along its principal axes.
fn clump_spin_energy(here: Clump, w: Spin) -> Real {
    return 0.5 * spin_dot(w, w / here.inverse_moments);
}

/// By how much more power the dashpots of a clump would take, W, if the velocities of half a step ago, with which they
/// were computed, were those of now: v and, along the axes of the scene, w.
fn damping_correction(c: u32, q: Orientation, v: Vec, w: Spin) -> Real {
    var sum = Real(0);
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let here = body(i);
        let arm = arm_of(q, member_id);
        let change = past_flow(v + surface_velocity(w, arm), arm) - here.velocity.v;
        let list = list_of(i);
        for (var entry = list.begin; entry < list.end; entry += list.step) {
            let tagged = neighbour[entry];
            if (tagged == NONE) {
                break;
            }
            let contact = contact_of(i, here, entry, tagged);
            if (contact.is_active) {
                sum -= dot(contact.damping, change + surface_velocity(w - here.spin, contact.arm));
                sum -= spin_dot(contact.couple_damping, w - here.spin);
            }
        }
    }
    return sum;
}

/// What a free clump has by itself, as `energies`.
fn energies_of_clump(c: u32) -> Energies {
    let here = clump(c);
    let inverse_mass = here.velocity.inverse_mass;
    if (inverse_mass == 0) {
        return Energies();
    }
    let all = contacts_of_clump(c, here.orientation);
    let v = here.velocity.v + velocity_change_now(here.velocity, all.force);
    let w = here.spin + clump_spin_change_now(c, here, all.torque);
    let kinetic = 0.5 * dot(v, v) / inverse_mass + clump_spin_energy(here, own_spin(here, w));
    let potential = -dot(params.gravity, here.center.x + here.center.low) / inverse_mass;
    let total = all.force + params.gravity / inverse_mass;
    let spin = global_spin(here.inverse_moments, here.orientation, w);
    // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
    let dissipation = 2 * params.damping * kinetic + damping_correction(c, here.orientation, v, spin);
    let momentum = v / inverse_mass;
    return Energies(kinetic, potential, sqrt(dot(total, total)), dissipation, momentum * v, outer_above(momentum, v));
}
