// twin: src/laws/answer.rs
// Contact dynamics of clumps: members hand the impulses of their contacts to their clump, which answers with its full inertia, and
// get the velocities of its surface. So a contact sees members only, as in the discrete element method, but for sweeps by colours.
// From `release` on the `_next` arrays have the velocities at the end of the step if nothing touched.

var<storage, read_write> mobility: array<Real>;      // slots, 1/kg: largest eigenvalue of W_kk
var<storage, read_write> response: array<Motion>;    // N, m/s, 1/kg: what members get from their clumps
var<storage, read_write> response_spin: array<Spin>; // N, rad/s

/// Velocity of body i at the end of the step if nothing touched its clump, and the inverse mass that impulses meet.
fn free_motion(i: u32) -> Motion {
    return motion_next[i];
}

/// The number of the grain that body i belongs to.
fn grain_of(i: u32) -> u32 {
    return owner[number[i]];
}

/// Velocity, m/s, of the point at the end of an arm from body i for an impulse there of 1 N s along each axis.
fn block_of(i: u32, arm: Vec) -> Columns {
    let label = number[i];
    let c = owner[label];
    let q = attitude[c] + attitude_residue_of(c);
    let turning = turning_block(q, held() * inverse_moments[c], arm_of(q, label) + arm);
    return plus(turning, motion_next[i].inverse_mass, identity());
}

/// What an impulse does to bodies i and j, which have met in a slot; j may be a wall. Keeps the slot's mobility. Both get the same
/// bits, because the body with the smaller index comes first.
fn lever_of(slot: u32, i: u32, j: u32, free: Motion, there: Motion, touch: Touch) -> Lever {
    var l = Lever();
    l.own = place[i].radius + 0.5 * touch.gap;
    let n = touch.n;
    let first = i < j;
    let arm = l.own * n;
    var arm_to = Vec();
    var w = Columns();
    if (j < params.bodies) {
        l.other = place[j].radius + 0.5 * touch.gap;
        arm_to = -l.other * n;
        w = block_of(select(i, j, first), select(arm, arm_to, first));
    }
    w = plus(block_of(select(j, i, first), select(arm_to, arm, first)), 1, w);
    let across = times(w, n);
    l.normal = dot(n, across);
    let along = across * (1 / l.normal) - n; // how a push along n moves the point across
    let tangents = plus(plus(plus(w, -1, outer(n, across)), -1, outer(across, n)), l.normal, outer(n, n));
    l.tangential = largest_eigenvalue(tangents);
    // More than W has there: so much that the two are nowhere less than W, which joins them, and that friction at its limit, which
    // answers to the normal impulse, makes it overshoot by half at most.
    let turned_aside = sqrt(dot(along, along));
    let joined = turned_aside * sqrt(l.normal / l.tangential);
    l.normal *= max(1 + joined, (1 + pair_of(i, j).friction * turned_aside) / 1.5);
    l.tangential *= 1 + joined;
    mobility[slot] = largest_eigenvalue(w);
    return l;
}

/// The largest eigenvalue of W_kk, 1/kg.
fn weight_of(slot: u32, tangential: Real) -> Real {
    return mobility[slot];
}

/// The clump will answer.
fn hold(i: u32, sum: Gathered) {
    pull[i] = sum.force;
    twist[i] = sum.torque;
}

fn answer_first(i: u32, sum: Gathered, contacts: u32) -> Effort {
    hold(i, sum);
    return Effort();
}

fn answer_pass(i: u32, sum: Gathered, here: Motion, spin: Spin) -> Real {
    hold(i, sum);
    return 0;
}

fn answer_probe(i: u32, sum: Gathered, here: Motion, spin: Spin) -> Real {
    hold(i, sum);
    return 0;
}

/// A body as a contact of a colour holds it: by its clump, for all of which the first member stands while sweeps go on.
struct Grip {
    motion: Motion, // of the first member
    spin: Spin,
    arm: Vec,       // m, from the first member's centre to the contact point
    lead: Vec,      // m, from the clump's centre to the first member's
    first: u32,     // index of the first member
    clump: u32,
    attitude: Attitude,
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
fn gripped(i: u32, arm: Vec) -> Grip {
    let label = number[i];
    let c = owner[label];
    let q = attitude[c] + attitude_residue_of(c);
    let first = whereabouts[first_member[c]];
    let lead = arm_of(q, first_member[c]);
    return Grip(ahead[first], ahead_spin[first], (arm_of(q, label) + arm) - lead, lead, first, c, q);
}

/// An impulse there.
fn push(i: u32, grip: Grip, impulse: Vec) {
    let spin = spin_from(grip.attitude, inverse_moments[grip.clump], moment(grip.lead + grip.arm, impulse));
    let v = grip.motion.inverse_mass * impulse + surface_velocity(spin, grip.lead);
    ahead[grip.first] = Motion(grip.motion.v + v, grip.motion.inverse_mass);
    ahead_spin[grip.first] = grip.spin + spin;
}

/// Members will fall in with the first of them.
fn answer_swept(i: u32) -> Real {
    return 0;
}

fn answer_gathered(i: u32, sum: Gathered) {
    hold(i, sum);
}

/// Spin that a moment, N m s, gives a clump, rad/s.
fn spin_from(q: Attitude, inverse_moments: Spin, torque: Spin) -> Spin {
    return held() * turned_spin(q, inverse_moments * turned_spin(conjugate(q), torque));
}

/// How a clump moves.
struct Course {
    v: Vec,
    spin: Spin, // along the axes of the scene
}

/// The product of two of them, J, with the inertia that impulses meet: of one with itself, twice its kinetic energy.
fn metric(here: Clump, a: Course, b: Course) -> Real {
    if (here.motion.inverse_mass == 0) {
        return 0;
    }
    let turning = spin_dot(own_spin(here, a.spin), own_spin(here, b.spin) / here.inverse_moments);
    return (dot(a.v, b.v) / here.motion.inverse_mass + turning) / held();
}

/// From a to b.
fn course_change(a: Course, b: Course) -> Course {
    return Course(b.v - a.v, b.spin - a.spin);
}

/// What the impulses that its members hold add to how a clump moves.
fn push_of(c: u32, here: Clump) -> Course {
    let sum = gathered_by_clump(c, here.attitude);
    return Course(freed(here.motion).inverse_mass * sum.force, spin_from(here.attitude, here.inverse_moments, sum.torque));
}

/// How a clump moves with them.
fn course_of(c: u32, here: Clump) -> Course {
    let push = push_of(c, here);
    return Course(clump_motion_next[c].v + push.v, clump_spin_next[c] + push.spin);
}

/// How its surface moves where a member is.
fn member_motion(here: Clump, course: Course, label: u32) -> Motion {
    let v = course.v + surface_velocity(course.spin, arm_of(here.attitude, label));
    return Motion(v, freed(here.motion).inverse_mass);
}

/// Members get the velocities of their clump's surface.
fn spread(c: u32, here: Clump, course: Course) {
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        response[i] = member_motion(here, course, label);
        response_spin[i] = course.spin;
    }
}

/// How a clump moves whose first member has these velocities.
fn course_by(c: u32, q: Attitude, first: Motion, spin: Spin) -> Course {
    return Course(first.v - surface_velocity(spin, arm_of(q, first_member[c])), spin);
}

/// As a pass starts from it, or sweeps have left it.
fn course_ahead(c: u32, q: Attitude) -> Course {
    let i = whereabouts[first_member[c]];
    return course_by(c, q, ahead[i], ahead_spin[i]);
}

/// Spin now, rad/s: that of the positions.
fn spin_of_clump_now(c: u32, here: Clump, torque: Spin) -> Spin {
    return here.spin;
}
