// twin: src/measure/body_sums.rs
// What a body adds to the sums over grains, for a row of the history and, where works are added up, for every step.

/// Sums with what free body i and its contacts have at step n.
fn with_body(before: PartialSums, i: u32) -> PartialSums {
    var sum = before;
    let here = body(i);
    if (here.velocity.inverse_mass == 0) {
        return sum;
    }
    var force = Vec();
    var torque = Spin();
    var drag = ForceTorque(); // of all dashpots
    let list = list_of(i);
    for (var entry = list.begin; entry < list.end; entry += list.step) {
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
            if ((tagged & ACTIVE) != 0u) {
                let forgotten = share * forgotten_energy(i, here, entry, tagged) / params.dt;
                sum.dissipation += forgotten;
                sum.sliding += forgotten;
            }
            continue;
        }
        force += contact.force;
        torque += contact_torque(contact);
        drag.force += contact.damping;
        drag.torque += contact.couple_damping;
        sum.elastic += share * contact.energy;
        let held = contact.force - contact.damping;
        sum.contact_force += share * sqrt(dot(held, held));
        sum.dissipation += share * (contact.dashpot + contact.sliding);
        sum.sliding += share * contact.sliding;
        sum.overlap = max(sum.overlap, -contact.gap / smaller);
        sum.sides += 1u;
        sum.single_sides += select(0u, 1u, single);
        sum.growth_power += share * growth_power(i, here, j, contact);
        if (j >= params.bodies) {
            sum.wall_power += wall_power(here, j - params.bodies, contact);
            continue;
        }
        if (single) {
            sum.fixed_power += fixed_power(here, j, contact);
        }
        let half = 0.5 * contact.gap;
        let branch = contact.arm * (1 + (position[j].radius + half) / (here.position.radius + half));
        sum.virial += share * (contact.force * branch);
        sum.virial_above += share * outer_above(contact.force, branch);
        // Rigid grains store nothing, and have no stiffness.
        if (contact.gap < 0 && contact.energy > 0) {
            let work = max(-dot(held, branch), Real(0)) / -contact.gap;
            sum.stiffness += share * STEEPEST * work * sqrt(dot(branch, branch));
        }
    }
    // What acts on a member acts on the centre of its clump.
    let arm = arm_in_grain(i);
    sum.virial += force * arm;
    sum.virial_above += outer_above(force, arm);
    let own = energies(here, ForceTorque(force, torque), drag);
    sum.kinetic += own.kinetic;
    sum.potential += own.potential;
    sum.growth_power += growth_power_of_mass(i, own);
    sum.net_force += own.net_force;
    sum.dissipation += own.dissipation;
    sum.flux += own.flux;
    sum.flux_above += own.flux_above;
    return sum;
}

/// How much steeper than a straight line from 0 forces grow with overlaps: that of elastic spheres with the power 3/2.
const STEEPEST: Real = 1.5;

/// Work that wall w does on a grain through this contact, per time, W.
fn wall_power(here: Body, w: u32, contact: Contact) -> Real {
    let v = wall_velocity(w, here.position.x + contact.arm);
    return dot(contact.force, v) + spin_dot(contact.couple, here.spin - relative_to_wall(here.spin, w));
}

/// The same of fixed grain j.
fn fixed_power(here: Body, j: u32, contact: Contact) -> Real {
    let spin = spin_of(j);
    let half = 0.5 * contact.gap;
    let arm = -contact.arm * ((position[j].radius + half) / (here.position.radius + half));
    return dot(contact.force, velocity[j].v + surface_velocity(spin, arm)) + spin_dot(contact.couple, spin);
}

/// What a step adds to the works since the host has read them, of works per time.
fn add_to_works(number: u32, powers: Works) {
    let before = works[number];
    works[number] = Works(
        before.dissipated + params.dt * powers.dissipated,
        before.walls + params.dt * powers.walls,
        before.fixed + params.dt * powers.fixed,
        before.cell + params.dt * powers.cell,
        before.growth + params.dt * powers.growth,
    );
}
