// twin: src/laws/answer.rs
// Contact dynamics of spheres and disks: every body answers to the impulses of its own contacts.

/// Velocity of body i at the end of the step if nothing touched it, and the inverse mass that impulses meet.
fn free_motion(i: u32) -> Motion {
    return freed(motion[i]);
}

/// The number of the grain that body i is.
fn grain_of(i: u32) -> u32 {
    return number[i];
}

/// What an impulse does to bodies i and j, which have met in a slot; j may be a wall, of which `there` says that it stands.
fn lever_of(slot: u32, i: u32, j: u32, free: Motion, there: Motion, touch: Touch) -> Lever {
    var l = Lever();
    l.own = place[i].radius + 0.5 * touch.gap;
    l.normal = free.inverse_mass + there.inverse_mass;
    if (j < params.bodies) {
        l.other = place[j].radius + 0.5 * touch.gap;
        l.tangential = l.other * l.other * inverse_inertia(place[j], there.inverse_mass);
    }
    l.tangential = l.normal + (l.tangential + l.own * l.own * inverse_inertia(place[i], free.inverse_mass));
    return l;
}

/// The largest eigenvalue of W_kk, 1/kg.
fn weight_of(slot: u32, tangential: Real) -> Real {
    return tangential;
}

/// Velocity and spin that impulses give body i.
struct Answer {
    motion: Motion,
    spin: Spin,
    inertia: Real, // its inverse, 1/(kg m²)
}

fn answer(i: u32, sum: Gathered) -> Answer {
    let free = free_motion(i);
    let inertia = inverse_inertia(place[i], free.inverse_mass);
    let spin = freed_spin(motion[i], spin_of(i)) + inertia * sum.torque;
    return Answer(Motion(free.v + free.inverse_mass * sum.force, free.inverse_mass), spin, inertia);
}

/// A step begins with the impulses of the last one, `contacts` of them.
fn answer_first(i: u32, sum: Gathered, contacts: u32) -> Effort {
    let start = answer(i, sum);
    trial[i] = start.motion;
    trial_before[i] = start.motion;
    ahead[i] = start.motion;
    keep_trial_spin(i, start.spin);
    keep_trial_spin_before(i, start.spin);
    keep_ahead_spin(i, start.spin);
    let free = free_motion(i);
    return reference(contacts, dot(free.v, free.v), free.inverse_mass);
}

/// A pass that started from these velocities has left these impulses. Work of the change, J.
fn answer_pass(i: u32, sum: Gathered, here: Motion, spin: Spin) -> Real {
    let next = answer(i, sum);
    trial_before[i] = next.motion;
    keep_trial_spin_before(i, next.spin);
    return metric(next.motion.v - here.v, next.motion.inverse_mass, next.spin - spin, next.inertia);
}

/// A pass of the power iteration from these velocities has left these impulses: they alone give velocities. Work, J.
fn answer_probe(i: u32, sum: Gathered, here: Motion, spin: Spin) -> Real {
    let inertia = inverse_inertia(place[i], here.inverse_mass);
    trial[i] = Motion(here.inverse_mass * sum.force, here.inverse_mass);
    keep_trial_spin(i, inertia * sum.torque);
    return metric(here.v, here.inverse_mass, spin, inertia);
}

/// A body as a contact of a colour holds it.
struct Grip {
    motion: Motion,
    spin: Spin,
    arm: Vec, // m, from the body's centre to the contact point
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
fn gripped(i: u32, arm: Vec) -> Grip {
    return Grip(ahead[i], ahead_spin_of(i), arm);
}

/// An impulse there.
fn push(i: u32, grip: Grip, impulse: Vec) {
    let inverse_mass = grip.motion.inverse_mass;
    let inertia = inverse_inertia(place[i], inverse_mass);
    ahead[i] = Motion(grip.motion.v + inverse_mass * impulse, inverse_mass);
    keep_ahead_spin(i, grip.spin + inertia * moment(grip.arm, impulse));
}

/// Sweeps have led body i from where they set out to where it is: how far against the way from the pass before, J.
fn answer_swept(i: u32) -> Real {
    var against = Real(0);
    let now = ahead[i];
    let last = trial[i].v;
    if (now.inverse_mass != 0) {
        let start = last + relaxation.beta * (last - trial_before[i].v);
        against = dot(start - now.v, now.v - last) / now.inverse_mass;
    }
    let spin = ahead_spin_of(i);
    let inertia = inverse_inertia(place[i], now.inverse_mass);
    if (inertia != 0) {
        let spin_last = trial_spin_of(i);
        let start = spin_last + relaxation.beta * (spin_last - trial_spin_before_of(i));
        against += spin_dot(start - spin, spin - spin_last) / inertia;
    }
    trial_before[i] = now;
    keep_trial_spin_before(i, spin);
    return against;
}

/// What sweeps have left is freed of its rounding.
fn answer_gathered(i: u32, sum: Gathered) {
    let now = answer(i, sum);
    settle(i, now.motion, now.spin);
}

/// Kinetic energy, twice, J.
fn metric(v: Vec, inverse_mass: Real, w: Spin, inertia: Real) -> Real {
    var twice = Real(0);
    if (inverse_mass != 0) {
        twice = dot(v, v) / inverse_mass;
    }
    if (inertia != 0) {
        twice += spin_squared(w) / inertia;
    }
    return twice;
}
