// twin: src/contact/law.rs
// Method slot: the discrete element method. Contacts are springs and dashpots: everything of section 2.1 that acts between two
// surfaces.

/// What two surfaces in contact do to the one that n points away from, N and W.
struct ContactForce {
    force: Vec,
    spring: Vec,
    damping: Vec,
    dissipation: Real,
}

fn contact_force(pair: Pair, gap: Real, n: Vec, n_before: Vec, v_rel: Vec, inverse_mass: Real, old: Vec) -> ContactForce {
    let approach = dot(v_rel, n);
    let damping = dashpot_force(pair, approach, inverse_mass);
    let pressing = normal_force(pair, gap) + damping;
    let stretched = stretched_spring(old, pair, n, n_before, v_rel);
    let spring = slid_spring(stretched, pair, pressing);
    return ContactForce(spring - pressing * n, spring, -damping * n, damping * approach + sliding_power(old, stretched, spring, pair));
}

/// The contact of grain i with grain j.
///
/// Both compute it from the same side, and the one it is not seen from turns the result around. So what acts on the two is
/// opposite to the last bit, however a driver fuses and reorders sums.
fn grain_contact(i: u32, here: Body, j: u32, old: Vec) -> Contact {
    let there = position[j];
    let low = position_low_of(j);
    let d = nearest_image(here.position.x, there.x, low.x - here.low.x);
    let back = backward(d.x);
    let branch = Point(select(d.x, -d.x, back), select(d.low, -d.low, back));
    let radius = select(here.position.radius, there.radius, back);
    let radius_to = select(there.radius, here.position.radius, back);
    let touch = sphere_separation(i, j, branch, radius, radius_to, here.low.radius + low.radius);
    var contact = Contact();
    contact.gap = touch.gap;
    contact.closed = touch.gap < 0;
    if (contact.closed) {
        // Erratum E7: one shared point, mid-overlap.
        let arm = (radius + 0.5 * touch.gap) * touch.n;
        let arm_to = -(radius_to + 0.5 * touch.gap) * touch.n;
        let other = velocity[j];
        let spin = spin_of(j);
        let v = select(here.velocity.v - other.v, other.v - here.velocity.v, back);
        let surface = surface_velocity(select(here.spin, spin, back), arm);
        let v_rel = v + (surface - surface_velocity(select(spin, here.spin, back), arm_to));
        let n_before = unit_or((branch.x + branch.low) + params.history_dt * v, touch.n);
        let inverse_mass = here.velocity.inverse_mass + other.inverse_mass;
        let p = contact_force(pair_of(i, j), touch.gap, touch.n, n_before, v_rel, inverse_mass, select(old, -old, back));
        contact.force = select(p.force, -p.force, back);
        contact.spring = select(p.spring, -p.spring, back);
        contact.arm = select(arm, arm_to, back);
        contact.damping = select(p.damping, -p.damping, back);
        contact.dissipation = p.dissipation;
    }
    return contact;
}

/// The contact of grain i with wall w.
fn wall_contact(i: u32, here: Body, w: u32, old: Vec) -> Contact {
    let touch = wall_separation(w, here.position, here.low);
    var contact = Contact();
    contact.gap = touch.gap;
    contact.closed = touch.gap < 0;
    if (contact.closed) {
        contact.arm = (here.position.radius + 0.5 * touch.gap) * touch.n;
        let v = here.velocity.v - wall_velocity(w, here.position.x + contact.arm);
        let v_rel = v + surface_velocity(here.spin, contact.arm);
        let n_before = wall_normal_before(w, here.position.x - params.history_dt * here.velocity.v);
        let pair = pair_of(i, params.bodies + w);
        let p = contact_force(pair, touch.gap, touch.n, n_before, v_rel, here.velocity.inverse_mass, old);
        contact.force = p.force;
        contact.spring = p.spring;
        contact.damping = p.damping;
        contact.dissipation = p.dissipation;
    }
    return contact;
}

/// The contact of grain i with entry `entry` of its list.
fn contact_of(i: u32, here: Body, entry: u32, tagged: u32) -> Contact {
    let j = tagged & INDEX;
    let old = spring_of(entry, tagged);
    if (j < params.bodies) {
        return grain_contact(i, here, j, old);
    }
    return wall_contact(i, here, j - params.bodies, old);
}

/// Velocity of a grain at the time of its position, m/s.
fn velocity_now(velocity: Velocity, force: Vec) -> Vec {
    return velocity_at_step(velocity, force);
}

/// Its spin then, rad/s.
fn spin_now(here: Body, torque: Spin) -> Spin {
    return sphere_spin_at_step(here, torque);
}

/// Whether a clump's spin is kept along the axes of the scene, and not along its own: no product of angular velocities turns up in
/// (2.21)-(2.23). So it is with fixed clumps.
fn spins_in_scene(inverse_moments: Spin) -> bool {
    return all_equal(inverse_moments);
}

/// What all contacts do to a body in a step.
struct BodyForces {
    sum: ForceTorque,
    crossed: bool, // its centre is beyond a wall
}

/// All contacts of body i, gathered in ascending order of the other's id. Their springs are kept.
fn body_forces(i: u32, here: Body) -> BodyForces {
    let end = list_start[i + 1u];
    var pushed = BodyForces();
    var entry = list_start[i];
    for (; entry < end; entry++) {
        let tagged = neighbour[entry];
        let j = tagged & INDEX;
        if (j >= params.bodies) {
            break;
        }
        let contact = grain_contact(i, here, j, spring_of(entry, tagged));
        if (contact.closed) {
            keep_spring(entry, contact.spring);
            pushed.sum.force += contact.force;
            pushed.sum.torque += moment(contact.arm, contact.force);
        }
        set_active(entry, tagged, contact.closed);
    }
    // Walls come last. Their loop ends in `break if`: where lanes go in step, as on software drivers, it costs those without
    // walls one pass over the body, and a check at the top would cost all one more.
    loop {
        if (entry < end && neighbour[entry] != NONE) {
            let tagged = neighbour[entry];
            let contact = wall_contact(i, here, (tagged & INDEX) - params.bodies, spring_of(entry, tagged));
            if (contact.closed) {
                keep_spring(entry, contact.spring);
                pushed.sum.force += contact.force;
                pushed.sum.torque += moment(contact.arm, contact.force);
                pushed.crossed |= contact.gap < -here.position.radius;
            }
            set_active(entry, tagged, contact.closed);
            entry++;
        } else {
            entry = end;
        }
        continuing {
            break if entry >= end;
        }
    }
    return pushed;
}
