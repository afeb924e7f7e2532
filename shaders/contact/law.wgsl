// twin: src/contact/law.rs
// The law of contact of the discrete element method: everything of section 2.1 that acts between two surfaces. Its
// sub-models are slots: normal, damping, tangential, rolling, cohesion. Each gets the state of the contact and what it
// remembers of it, and owns that memory.

/// All that the laws of contact know of two surfaces, seen from the first of the two.
struct ContactState {
    gap: Real,             // m, < 0 is overlap
    opening: Real,         // m, by what the gap has grown in this step
    n: Vec,                // from the first to the second
    twist: Real,           // of the contact about n in this step, see the twist slot
    n_before: Vec,         // a step ago
    v: Vec,                // m/s, of the first past the second at the contact point
    spin: Spin,            // rad/s, of the first relative to the second
    inverse_mass: Real,    // 1/kg, 1/m_i + 1/m_j
    radius: Real,          // m, effective: 1/R = 1/R_i + 1/R_j
    inverse_rolling_inertia: Real, // 1/(kg m²), of both about the contact point
    materials: u32,        // where their pair of materials is in tables of pairs
}

/// What two surfaces in contact do to the first of the two.
struct ContactForce {
    force: Vec,        // N
    couple: Spin,      // N m
    damping: Vec,      // N, the part of the force that is the normal dashpot's
    couple_damping: Spin, // N m, the part of the couple that is the rolling dashpot's
    dashpot: Real,     // W, dissipation of dashpots
    sliding: Real,     // W, that of sliding and plastic rolling since a step ago
    energy: Real,      // J, stored
    history: History,
}

fn contact_force(pair: Pair, c: ContactState, old: History) -> ContactForce {
    if (!overlaps(c.gap)) {
        return ContactForce(cohesive_force(c) * c.n, Spin(), Vec(), Spin(), Real(0), Real(0), cohesive_energy(c), History());
    }
    let approach = dot(c.v, c.n);
    let stiffness = normal_stiffness(pair, c);
    let damping = damping_force(pair, approach, c.inverse_mass, stiffness);
    let normal = normal_force(pair, c) + damping;
    let tangential = tangential_contact(pair, c, normal, old.tangential);
    let rolling = rolling_contact(c, stiffness, normal, old.rolling);
    return ContactForce(
        tangential.force - (normal - cohesive_force(c)) * c.n,
        rolling.couple,
        -damping * c.n,
        rolling.damping,
        damping * approach + rolling.dashpot,
        tangential.dissipation + rolling.plastic,
        normal_energy(pair, c) + cohesive_energy(c) + stored_energy(pair, c, tangential.history, rolling.history),
        History(tangential.history, rolling.history),
    );
}

/// Energy of what a contact remembers, J; of the stiffness that the surfaces have at `c.gap`.
fn stored_energy(pair: Pair, c: ContactState, tangential: TangentialHistory, rolling: RollingHistory) -> Real {
    return tangential_energy(pair, c, tangential) + rolling_energy(c, normal_stiffness(pair, c), rolling);
}

/// What the laws are told of grains i and j.
fn grain_state(i: u32, here: Body, j: u32, p: OrientedPair) -> ContactState {
    let n = p.separation.n;
    let gap = p.separation.gap;
    // Erratum E7: one shared point, mid-overlap.
    let arm = (p.radius + 0.5 * gap) * n;
    let arm_to = -(p.radius_to + 0.5 * gap) * n;
    let other = velocity[j];
    let spin = spin_of(j);
    let branch = p.branch.x + p.branch.low;
    let flowing = past_flow(select(here.velocity.v - other.v, other.v - here.velocity.v, p.back), branch);
    let v = past_growth(flowing, n, select(i, j, p.back), p.radius, select(j, i, p.back), p.radius_to);
    let surface = surface_velocity(select(here.spin, spin, p.back), arm);
    var c = ContactState();
    c.gap = gap;
    c.opening = -lengthened(branch, params.history_dt * v);
    c.n = n;
    c.n_before = unit_or(branch + params.history_dt * v, n);
    c.twist = twist_of(n, here.spin + spin);
    c.v = v + (surface - surface_velocity(select(spin, here.spin, p.back), arm_to));
    c.spin = select(here.spin - spin, spin - here.spin, p.back);
    c.inverse_mass = here.velocity.inverse_mass + other.inverse_mass;
    c.radius = p.radius * p.radius_to / (p.radius + p.radius_to);
    let own = inverse_rolling_inertia(here.position.radius, here.velocity.inverse_mass);
    c.inverse_rolling_inertia = own + inverse_rolling_inertia(position[j].radius, other.inverse_mass);
    c.materials = pair_index(i, j);
    return c;
}

/// The contact of grain i with grain j.
///
/// Both compute it from the same side, and the one it is not seen from turns the result around. So what acts on the two
/// is opposite to the last bit, however a driver fuses and reorders sums.
fn grain_contact(i: u32, here: Body, j: u32, tagged: u32, old: History) -> Contact {
    let p = oriented_pair(i, here, j);
    var contact = Contact();
    contact.gap = p.separation.gap;
    contact.is_active = is_active(pair_index(i, j), contact.gap, (tagged & ACTIVE) != 0u);
    if (contact.is_active) {
        let arm = (p.radius + 0.5 * p.separation.gap) * p.separation.n;
        let arm_to = -(p.radius_to + 0.5 * p.separation.gap) * p.separation.n;
        let f = contact_force(pair_of(i, j), grain_state(i, here, j, p), opposite(old, p.back));
        contact.is_deep = is_deep(contact.gap, min(p.radius, p.radius_to));
        contact.force = select(f.force, -f.force, p.back);
        contact.arm = select(arm, arm_to, p.back);
        contact.couple = select(f.couple, -f.couple, p.back);
        contact.damping = select(f.damping, -f.damping, p.back);
        contact.couple_damping = select(f.couple_damping, -f.couple_damping, p.back);
        contact.dashpot = f.dashpot;
        contact.sliding = f.sliding;
        contact.energy = f.energy;
        contact.history = opposite(f.history, p.back);
    }
    return contact;
}

/// What the laws are told of grain i and wall w.
fn wall_state(i: u32, here: Body, w: u32, separation: Separation) -> ContactState {
    let arm = (here.position.radius + 0.5 * separation.gap) * separation.n;
    let passing = here.velocity.v - wall_velocity(w, here.position.x + arm);
    let v = past_growth(passing, separation.n, i, here.position.radius, params.bodies + w, 0);
    var c = ContactState();
    c.gap = separation.gap;
    c.opening = -params.history_dt * dot(v, separation.n);
    c.n = separation.n;
    c.n_before = wall_normal_before(w, here.position.x - params.history_dt * here.velocity.v);
    c.v = v + surface_velocity(here.spin, arm);
    c.spin = relative_to_wall(here.spin, w);
    c.twist = twist_of(separation.n, here.spin + (here.spin - c.spin));
    c.inverse_mass = here.velocity.inverse_mass;
    c.radius = here.position.radius;
    c.inverse_rolling_inertia = inverse_rolling_inertia(here.position.radius, here.velocity.inverse_mass);
    c.materials = pair_index(i, params.bodies + w);
    return c;
}

/// The contact of grain i with wall w.
fn wall_contact(i: u32, here: Body, w: u32, tagged: u32, old: History) -> Contact {
    let separation = wall_separation(w, here.position, here.low);
    var contact = Contact();
    contact.gap = separation.gap;
    contact.is_active = is_active(pair_index(i, params.bodies + w), contact.gap, (tagged & ACTIVE) != 0u);
    if (contact.is_active) {
        contact.is_deep = is_deep(contact.gap, here.position.radius);
        contact.arm = (here.position.radius + 0.5 * separation.gap) * separation.n;
        let f = contact_force(pair_of(i, params.bodies + w), wall_state(i, here, w, separation), old);
        contact.force = f.force;
        contact.couple = f.couple;
        contact.damping = f.damping;
        contact.couple_damping = f.couple_damping;
        contact.dashpot = f.dashpot;
        contact.sliding = f.sliding;
        contact.energy = f.energy;
        contact.history = f.history;
    }
    return contact;
}

/// Moment of a contact about the grain's centre, N m. Taken where it is summed, so that a driver may fuse the product
/// into the sum.
fn contact_torque(contact: Contact) -> Spin {
    return with_couple(moment(contact.arm, contact.force), contact.couple);
}

/// The contact of grain i at an entry of its list.
fn contact_of(i: u32, here: Body, entry: u32, tagged: u32) -> Contact {
    let j = tagged & INDEX;
    let old = history_of(entry, tagged);
    if (j < params.bodies) {
        return grain_contact(i, here, j, tagged, old);
    }
    return wall_contact(i, here, j - params.bodies, tagged, old);
}

/// Energy, J, of what a contact that has opened still remembers, and the next step forgets: as it was a step ago, less
/// the work that its springs, which still pulled then, have done by half of their force.
fn forgotten_energy(i: u32, here: Body, entry: u32, tagged: u32) -> Real {
    let j = tagged & INDEX;
    var c = ContactState();
    var old = history_of(entry, tagged);
    if (j < params.bodies) {
        let p = oriented_pair(i, here, j);
        c = grain_state(i, here, j, p);
        old = opposite(old, p.back);
    } else {
        let w = j - params.bodies;
        c = wall_state(i, here, w, wall_separation(w, here.position, here.low));
    }
    let power = dot(old.tangential.force, c.v) + spin_dot(old.rolling.torque, c.spin);
    c.gap -= c.opening;
    return stored_energy(pair_of(i, j), c, old.tangential, old.rolling) - 0.5 * params.history_dt * power;
}

/// Change of the velocity of a grain to the time of its position, m/s.
fn velocity_change_now(velocity: Velocity, force: Vec) -> Vec {
    return velocity_change_to_step(velocity, force);
}

/// That of its spin, rad/s.
fn spin_change_now(here: Body, torque: Spin) -> Spin {
    return sphere_spin_change_to_step(here, torque);
}

/// Whether a clump's spin is kept along the axes of the scene, and not along its own: no product of angular velocities
/// turns up in (2.21)-(2.23). So it is with fixed clumps.
fn spins_in_scene(inverse_moments: Spin) -> bool {
    return all_equal(inverse_moments);
}

/// What all contacts do to a body in a step.
struct BodyForces {
    sum: ForceTorque,
    crossed: bool, // its centre is beyond a wall
    deep: bool,    // one of them is deep
}

/// All contacts of body i, gathered in ascending order of the other's id. Their history is kept.
fn body_forces(i: u32, here: Body) -> BodyForces {
    let list = list_of(i);
    let end = list.end;
    var forces = BodyForces();
    var entry = list.begin;
    for (; entry < end; entry += list.step) {
        let tagged = neighbour[entry];
        let j = tagged & INDEX;
        if (j >= params.bodies) {
            break;
        }
        let contact = grain_contact(i, here, j, tagged, history_of(entry, tagged));
        if (contact.is_active) {
            set_history(entry, contact.history);
            forces.sum.force += contact.force;
            forces.sum.torque += contact_torque(contact);
            forces.deep |= contact.is_deep;
        }
        set_active(entry, tagged, contact.is_active);
    }
    // Walls come last. Their loop ends in `break if`: where lanes go in step, as on software drivers, it costs those
    // without walls one pass over the body, and a check at the top would cost all one more.
    loop {
        if (entry < end && neighbour[entry] != NONE) {
            let tagged = neighbour[entry];
            let contact = wall_contact(i, here, (tagged & INDEX) - params.bodies, tagged, history_of(entry, tagged));
            if (contact.is_active) {
                set_history(entry, contact.history);
                forces.sum.force += contact.force;
                forces.sum.torque += contact_torque(contact);
                forces.crossed |= is_crossed(contact.gap, here.position.radius);
                forces.deep |= contact.is_deep;
            }
            set_active(entry, tagged, contact.is_active);
            entry += list.step;
        } else {
            entry = end;
        }
        continuing {
            break if entry >= end;
        }
    }
    return forces;
}

/// Tell the host of a deep contact: whether there is one.
fn report_deep(deep: bool) -> bool {
    if (deep) {
        atomicMax(&counters.deep_overlaps, 1u);
    }
    return deep;
}
