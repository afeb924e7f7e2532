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
fn contact_of(i: u32, here: Body, slot: u32, entry: u32) -> Contact {
    let j = entry & INDEX;
    var contact = Contact();
    var touch: Touch;
    var there: Place;
    if (j < params.bodies) {
        there = place[j];
        touch = touch_grain(i, j, here.place, there, residue_of(j) - here.residue);
    } else {
        touch = touch_wall(j - params.bodies, here.place.x, here.residue, here.place.radius);
    }
    contact.gap = touch.gap;
    if (touch.gap < 0) {
        let n = touch.n;
        let arm = (here.place.radius + 0.5 * touch.gap) * n; // erratum E7: one shared point, mid-overlap
        var v_rel: Vec;
        var n_before: Vec;
        var inverse_mass = here.motion.inverse_mass;
        if (j < params.bodies) {
            let other = motion[j];
            let v = here.motion.v - other.v;
            let arm_there = -(there.radius + 0.5 * touch.gap) * n;
            v_rel = v + (surface_velocity(here.spin, arm) - surface_velocity(spin_of(j), arm_there));
            n_before = unit_or((here.place.radius + there.radius + touch.gap) * n + params.since * v, n);
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
        let stretched = stretched_spring(spring_of(slot, entry), pair, n, n_before, v_rel);
        contact.spring = slid_spring(stretched, pair, pressing);
        contact.force = -pressing * n + contact.spring;
        contact.arm = arm;
        contact.dissipation = damping * approach + sliding_power(stretched, contact.spring, pair);
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
