// twin: src/laws/contact.rs
// Method slot: the discrete element method. Contacts are springs and dashpots: everything of section 2.1 that acts between two
// surfaces.

/// What two surfaces in contact do to the one that n points away from, N and W.
struct Push {
    force: Vec,
    spring: Vec,
    damping: Vec,
    dissipation: Real,
}

fn push(pair: Pair, gap: Real, n: Vec, n_before: Vec, v_rel: Vec, inverse_mass: Real, old: Vec) -> Push {
    let approach = dot(v_rel, n);
    let damping = dashpot_force(pair, approach, inverse_mass);
    let pressing = normal_force(pair, gap) + damping;
    let stretched = stretched_spring(old, pair, n, n_before, v_rel);
    let spring = slid_spring(stretched, pair, pressing);
    return Push(spring - pressing * n, spring, -damping * n, damping * approach + sliding_power(old, stretched, spring, pair));
}

/// The contact of grain i with grain j.
///
/// Both compute it from the same side, and the one it is not seen from turns the result around. So what acts on the two is
/// opposite to the last bit, however a driver fuses and reorders sums.
fn grain_contact(i: u32, here: Body, j: u32, old: Vec) -> Contact {
    let there = place[j];
    let residue = residue_of(j);
    let d = between(here.place.x, there.x, residue.x - here.residue.x);
    let back = backward(d.x);
    let way = Point(select(d.x, -d.x, back), select(d.residue, -d.residue, back));
    let radius = select(here.place.radius, there.radius, back);
    let radius_to = select(there.radius, here.place.radius, back);
    let touch = touch_grain(i, j, way, radius, radius_to, here.residue.radius + residue.radius);
    var contact = Contact();
    contact.gap = touch.gap;
    contact.closed = touch.gap < 0;
    if (contact.closed) {
        // Erratum E7: one shared point, mid-overlap.
        let arm = (radius + 0.5 * touch.gap) * touch.n;
        let arm_to = -(radius_to + 0.5 * touch.gap) * touch.n;
        let other = motion[j];
        let spin = spin_of(j);
        let v = select(here.motion.v - other.v, other.v - here.motion.v, back);
        let surface = surface_velocity(select(here.spin, spin, back), arm);
        let v_rel = v + (surface - surface_velocity(select(spin, here.spin, back), arm_to));
        let n_before = unit_or((way.x + way.residue) + params.since * v, touch.n);
        let inverse_mass = here.motion.inverse_mass + other.inverse_mass;
        let p = push(pair_of(i, j), touch.gap, touch.n, n_before, v_rel, inverse_mass, select(old, -old, back));
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
    let touch = touch_wall(w, here.place, here.residue);
    var contact = Contact();
    contact.gap = touch.gap;
    contact.closed = touch.gap < 0;
    if (contact.closed) {
        contact.arm = (here.place.radius + 0.5 * touch.gap) * touch.n;
        let v = here.motion.v - wall_velocity(w, here.place.x + contact.arm);
        let v_rel = v + surface_velocity(here.spin, contact.arm);
        let n_before = wall_normal_before(w, here.place.x - params.since * here.motion.v);
        let pair = pair_of(i, params.bodies + w);
        let p = push(pair, touch.gap, touch.n, n_before, v_rel, here.motion.inverse_mass, old);
        contact.force = p.force;
        contact.spring = p.spring;
        contact.damping = p.damping;
        contact.dissipation = p.dissipation;
    }
    return contact;
}

/// The contact of grain i with entry `entry` of its list.
fn contact_of(i: u32, here: Body, slot: u32, entry: u32) -> Contact {
    let j = entry & INDEX;
    let old = spring_of(slot, entry);
    if (j < params.bodies) {
        return grain_contact(i, here, j, old);
    }
    return wall_contact(i, here, j - params.bodies, old);
}

/// Velocity of a grain at the time of its position, m/s.
fn velocity_now(motion: Motion, force: Vec) -> Vec {
    return at_step(motion, force);
}

/// Its spin then, rad/s.
fn spin_now(here: Body, torque: Spin) -> Spin {
    return spin_at_step(here, torque);
}

/// Whether a clump's spin is kept along the axes of the scene, and not along its own: no product of angular velocities turns up in
/// (2.21)-(2.23). So it is with fixed clumps.
fn spins_in_scene(inverse_moments: Spin) -> bool {
    return all_equal(inverse_moments);
}

/// What all contacts do to a body in a step.
struct Pushed {
    sum: Gathered,
    crossed: bool, // its centre is beyond a wall
}

/// All contacts of body i, gathered in ascending order of the other's id. Their springs are kept.
fn pushed(i: u32, here: Body) -> Pushed {
    let end = slot_start[i + 1u];
    var pushed = Pushed();
    var slot = slot_start[i];
    for (; slot < end; slot++) {
        let entry = neighbour[slot];
        let j = entry & INDEX;
        if (j >= params.bodies) {
            break;
        }
        let contact = grain_contact(i, here, j, spring_of(slot, entry));
        if (contact.closed) {
            keep_spring(slot, contact.spring);
            pushed.sum.force += contact.force;
            pushed.sum.torque += moment(contact.arm, contact.force);
        }
        flag(slot, entry, contact.closed);
    }
    // Walls come last. Their loop ends in `break if`: where lanes go in step, as on software drivers, it costs those without
    // walls one pass over the body, and a check at the top would cost all one more.
    loop {
        if (slot < end && neighbour[slot] != NONE) {
            let entry = neighbour[slot];
            let contact = wall_contact(i, here, (entry & INDEX) - params.bodies, spring_of(slot, entry));
            if (contact.closed) {
                keep_spring(slot, contact.spring);
                pushed.sum.force += contact.force;
                pushed.sum.torque += moment(contact.arm, contact.force);
                pushed.crossed |= contact.gap < -here.place.radius;
            }
            flag(slot, entry, contact.closed);
            slot++;
        } else {
            slot = end;
        }
        continuing {
            break if slot >= end;
        }
    }
    return pushed;
}
