// twin: src/laws/answer.rs
// Contact dynamics of clumps: members hand the impulses of their contacts to their clump, which answers with its full inertia, and
// get the velocities of its surface. So a contact sees members only, as in the discrete element method. From `release` on the
// `_next` arrays have the velocities at the end of the step if nothing touched.

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
    let tangents = plus(plus(plus(w, -1, outer(n, across)), -1, outer(across, n)), l.normal, outer(n, n));
    l.tangential = largest_eigenvalue(tangents);
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

/// Spin that a moment, N m s, gives a clump, rad/s.
fn spin_from(here: Clump, torque: Spin) -> Spin {
    return held() * turned_spin(here.attitude, here.inverse_moments * turned_spin(conjugate(here.attitude), torque));
}

/// Kinetic energy of a clump with these velocities, twice, J, with the inertia that impulses meet.
fn metric(here: Clump, v: Vec, w: Spin) -> Real {
    if (here.motion.inverse_mass == 0) {
        return 0;
    }
    return (dot(v, v) / here.motion.inverse_mass + 2 * turning_energy(here, own_spin(here, w))) / held();
}

/// How a clump moves.
struct Course {
    v: Vec,
    spin: Spin, // along the axes of the scene
}

/// What the impulses that its members hold add to how a clump moves.
fn push_of(c: u32, here: Clump) -> Course {
    let sum = gathered_by_clump(c, here.attitude);
    return Course(freed(here.motion).inverse_mass * sum.force, spin_from(here, sum.torque));
}

/// How a clump moves with them.
fn course_of(c: u32, here: Clump) -> Course {
    let push = push_of(c, here);
    return Course(clump_motion_next[c].v + push.v, clump_spin_next[c] + push.spin);
}

/// Members get the velocities of their clump's surface.
fn spread(c: u32, here: Clump, course: Course) {
    let inverse_mass = freed(here.motion).inverse_mass;
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let v = course.v + surface_velocity(course.spin, arm_of(here.attitude, label));
        response[i] = Motion(v, inverse_mass);
        response_spin[i] = course.spin;
    }
}

/// As a pass starts from it.
fn course_ahead(c: u32, q: Attitude) -> Course {
    let label = first_member[c];
    let i = whereabouts[label];
    let spin = ahead_spin[i];
    return Course(ahead[i].v - surface_velocity(spin, arm_of(q, label)), spin);
}

/// Spin now, rad/s: that of the positions.
fn spin_of_clump_now(c: u32, here: Clump, torque: Spin) -> Spin {
    return here.spin;
}
