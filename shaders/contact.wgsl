// twin: src/laws/contact.rs
// One contact, seen from one of its two sides: everything of section 2.1 that acts between two surfaces.

struct Contact {
    gap: Real,        // m, >= 0: no contact, and nothing below means anything
    force: Vec,       // N, on the grain of interest
    arm: Vec,         // m, from its centre to the contact point
    spring: Vec,      // N, the tangential part of the force
    dissipation: Real // W, of dashpot and sliding
}

/// Whether the neighbour may touch: an answer without residues, for the price of one place.
fn near(here: Place, j: u32) -> bool {
    if (j >= params.bodies) {
        return true;
    }
    return within(here, place[j], 0);
}

/// The contact of grain i with entry `entry` of its list.
///
/// Two grains compute their contact from the same side, `from` one of them `to` the other, and the one it is not seen from
/// turns the result around. So what acts on the two is opposite to the last bit, however a driver fuses and reorders sums.
fn contact_of(i: u32, here: Body, slot: u32, entry: u32) -> Contact {
    let j = entry & INDEX;
    var contact = Contact();
    var touch: Touch;
    var radius = here.place.radius;
    var radius_to = radius;
    var back = false;
    if (j < params.bodies) {
        let there = place[j];
        var way = between(here.place.x, there.x, residue_of(j) - here.residue);
        back = backward(way.x);
        if (back) {
            way = Point(-way.x, -way.residue);
            radius = there.radius;
        } else {
            radius_to = there.radius;
        }
        touch = touch_grain(i, j, way, radius, radius_to);
    } else {
        touch = touch_wall(j - params.bodies, here.place.x, here.residue, radius);
    }
    contact.gap = touch.gap;
    if (touch.gap < 0) {
        let n = touch.n;
        // Erratum E7: one shared point, mid-overlap.
        let arm = (radius + 0.5 * touch.gap) * n;
        let arm_to = -(radius_to + 0.5 * touch.gap) * n;
        var v_rel: Vec;
        var n_before: Vec;
        var inverse_mass = here.motion.inverse_mass;
        if (j < params.bodies) {
            let other = motion[j];
            let spin = spin_of(j);
            let v = select(here.motion.v - other.v, other.v - here.motion.v, back);
            let surface = surface_velocity(select(here.spin, spin, back), arm);
            v_rel = v + (surface - surface_velocity(select(spin, here.spin, back), arm_to));
            n_before = unit_or((radius + radius_to + touch.gap) * n + params.since * v, n);
            inverse_mass += other.inverse_mass;
        } else {
            let w = j - params.bodies;
            v_rel = (here.motion.v - wall_velocity(w, here.place.x + arm)) + surface_velocity(here.spin, arm);
            n_before = wall_normal_before(w, here.place.x - params.since * here.motion.v);
        }
        let pair = pair_of(i, j);
        let approach = dot(v_rel, n);
        let damping = dashpot_force(pair, approach, inverse_mass);
        let pressing = normal_force(pair, touch.gap) + damping;
        let old = spring_of(slot, entry);
        let stretched = stretched_spring(select(old, -old, back), pair, n, n_before, v_rel);
        let spring = slid_spring(stretched, pair, pressing);
        let force = spring - pressing * n;
        contact.spring = select(spring, -spring, back);
        contact.force = select(force, -force, back);
        contact.arm = select(arm, arm_to, back);
        contact.dissipation = damping * approach + sliding_power(stretched, spring, pair);
    }
    return contact;
}

/// Force and moment of all contacts of a grain.
struct Gathered {
    force: Vec,
    torque: Spin,
}

/// All contacts of grain i, in ascending order of the other's id. The springs stay as they are.
fn contacts_of(i: u32, here: Body) -> Gathered {
    var sum = Gathered();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let contact = contact_of(i, here, slot, entry);
        if (contact.gap < 0) {
            sum.force += contact.force;
            sum.torque += moment(contact.arm, contact.force);
        }
    }
    return sum;
}
