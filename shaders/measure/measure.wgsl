// twin: src/measure/measure.rs
// Sums over free grains at step n, in an order that no sorting changes: row p adds up the grains with the numbers p, p +
// parts, p + 2 parts, …
@compute @workgroup_size(WG)
fn measure(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len) {
        return;
    }
    var sum = PartialSums();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        let i = index_of_id[number];
        let here = body(i);
        let inverse_mass = here.velocity.inverse_mass;
        if (inverse_mass == 0) {
            continue;
        }
        var force = Vec();
        var torque = Spin();
        var drag = ForceTorque(); // of all dashpots
        let end = list_start[i + 1u];
        for (var entry = list_start[i]; entry < end; entry++) {
            let tagged = neighbour[entry];
            if (tagged == NONE) {
                break;
            }
            let contact = contact_of(i, here, entry, tagged);
            let j = tagged & INDEX;
            var smaller = here.position.radius;
            var single = true;
            if (j < params.bodies) {
                smaller = min(smaller, position[j].radius);
                single = velocity[j].inverse_mass == 0;
            }
            let share = select(Real(0.5), Real(1), single);
            if (!contact.is_active) {
                // Opened since the last step, if it remembers something, whose energy the next step forgets.
                sum.dissipation += share * forgotten_energy(i, here, entry, tagged) / params.dt;
                continue;
            }
            force += contact.force;
            torque += contact_torque(contact);
            drag.force += contact.damping;
            drag.torque += contact.couple_damping;
            sum.elastic += share * contact.energy;
            let held = contact.force - contact.damping;
            sum.contact_force += share * sqrt(dot(held, held));
            sum.dissipation += share * contact.dissipation;
            sum.overlap = max(sum.overlap, -contact.gap / smaller);
            sum.sides += 1u;
            sum.single_sides += select(0u, 1u, single);
        }
        let own = energies(here, ForceTorque(force, torque), drag);
        sum.kinetic += own.kinetic;
        sum.potential += own.potential;
        sum.net_force += own.net_force;
        sum.dissipation += own.dissipation;
    }
    partial_sums[p] = sum;
}
