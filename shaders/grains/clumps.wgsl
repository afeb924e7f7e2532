// twin: src/laws/grains.rs
// Grains slot: bodies are the members of clumps, rigid sets of spheres or disks. Contacts are those of members; a clump gathers
// what acts on its members, moves and turns by (2.40), and its members follow from where it is. They are never
// moved on their own, so they cannot drift apart. Owns the clumps, in the order of the scene.

var<storage, read> owner: array<u32>;                       // N, by number: the member's clump
var<storage, read> offset: array<Packed>;                   // N, by number, m: from the clump's centre, along its principal axes
var<storage, read_write> whereabouts: array<u32>;           // N, by number: the member's index
var<storage, read> first_member: array<u32>;                // C + 1: number of a clump's first member
var<storage, read> inverse_moments: array<Spin>;            // C, 1/(kg m²), 1/J1, 1/J2, 1/J3; 0 of a fixed clump
var<storage, read> center: array<Vec>;                      // C, m, centre of mass, at step n
var<storage, read_write> center_next: array<Vec>;           // C
var<storage, read> attitude: array<Attitude>;               // C, from the principal axes to those of the scene, at step n
var<storage, read_write> attitude_next: array<Attitude>;    // C
var<storage, read> clump_motion: array<Motion>;             // C, at n - 1/2
var<storage, read_write> clump_motion_next: array<Motion>;  // C
var<storage, read> clump_spin: array<Spin>;                 // C, rad/s, at n - 1/2, along the principal axes; of round clumps x, y, z
var<storage, read_write> clump_spin_next: array<Spin>;      // C
var<storage, read_write> spin_gain: array<Spin>;            // C, rad/s: Δω of the last step, where the next predictor starts
var<storage, read_write> pull: array<Vec>;                  // N, N: force of all contacts of a member; N s in contact dynamics
var<storage, read_write> twist: array<Spin>;                // N, N m or N m s: their moment about the member's centre
var<storage, read_write> rounds: Rounds;

/// How hard the iterations for the rotation had to work.
struct Rounds {
    most: atomic<u32>,   // rounds of a step of a clump
    capped: atomic<u32>, // steps of clumps that ended before they met the tolerance
}

/// A step that is not settled after so many rounds is counted.
const MOST_ROUNDS = 25u;

/// A step of a clump has taken this many.
fn count_rounds(count: u32, settled: bool) {
    if (count > atomicLoad(&rounds.most)) {
        atomicMax(&rounds.most, count);
    }
    if (!settled) {
        atomicAdd(&rounds.capped, 1u);
    }
}

/// All there is to know of a clump.
struct Clump {
    center: Point,
    attitude: Attitude,
    motion: Motion,
    spin: Spin,
    inverse_moments: Spin,
}

fn clump(c: u32) -> Clump {
    let center = Point(center[c], center_residue_of(c));
    return Clump(center, attitude[c] + attitude_residue_of(c), clump_motion[c], clump_spin[c], inverse_moments[c]);
}

/// Whether bodies i and j belong to one grain.
fn same_grain(i: u32, j: u32) -> bool {
    return owner[number[i]] == owner[number[j]];
}

/// The body of this number is at index i from now on.
fn keep_index(label: u32, i: u32) {
    whereabouts[label] = i;
}

/// How many bodies the grain of body i has.
fn members_of(i: u32) -> u32 {
    let c = owner[number[i]];
    return first_member[c + 1u] - first_member[c];
}

/// One of them.
fn member_of(i: u32, m: u32) -> u32 {
    return whereabouts[first_member[owner[number[i]]] + m];
}

/// Nothing: a member has no energy by itself, see `measure_clumps`.
fn energies(here: Body, sum: Gathered, drag: Vec) -> Energies {
    return Energies();
}

/// Spin along the axes of the scene, rad/s.
fn global_spin(inverse_moments: Spin, q: Attitude, w: Spin) -> Spin {
    if (spins_in_scene(inverse_moments)) {
        return w;
    }
    return turned_spin(q, w);
}

/// The same spin along the principal axes, rad/s.
fn own_spin(here: Clump, w: Spin) -> Spin {
    if (!spins_in_scene(here.inverse_moments)) {
        return w;
    }
    return turned_spin(conjugate(here.attitude), w);
}

/// J, of a free clump that spins so along its principal axes.
fn turning_energy(here: Clump, w: Spin) -> Real {
    return 0.5 * spin_dot(w, w / here.inverse_moments);
}

/// From the centre of the clump to a member, m.
fn arm_of(q: Attitude, label: u32) -> Vec {
    return turned(q, unpacked(offset[label]));
}

/// Force and moment, about the clump's centre, of what `pull` and `twist` hold for its members.
fn gathered_by_clump(c: u32, q: Attitude) -> Gathered {
    var sum = Gathered();
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let force = pull[i];
        sum.force += force;
        sum.torque += twist[i] + moment(arm_of(q, label), force);
    }
    return sum;
}

/// Force and moment, about the clump's centre, of all contacts of all its members. The springs stay as they are.
fn contacts_of_clump(c: u32, q: Attitude) -> Gathered {
    var sum = Gathered();
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let member = contacts_of(i, body(i));
        sum.force += member.force;
        sum.torque += member.torque + moment(arm_of(q, label), member.force);
    }
    return sum;
}

/// By how much more power the dashpots of a clump would take, W, if the velocities of half a step ago, with which they were
/// computed, were those of now: v and, along the axes of the scene, w.
fn dashpots_late(c: u32, q: Attitude, v: Vec, w: Spin) -> Real {
    var sum = Real(0);
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let here = body(i);
        let change = v + surface_velocity(w, arm_of(q, label)) - here.motion.v;
        for (var slot = slot_start[i]; slot < slot_start[i + 1u]; slot++) {
            let entry = neighbour[slot];
            if (entry == NONE) {
                break;
            }
            let contact = contact_of(i, here, slot, entry);
            if (contact.closed) {
                sum -= dot(contact.damping, change + surface_velocity(w - here.spin, contact.arm));
            }
        }
    }
    return sum;
}

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those of the
/// body from the right. What rounding has done to its length is undone.
fn attitude_step(c: u32, here: Clump, w: Spin) -> Attitude {
    let q = here.attitude;
    let turn = attitude_gain(0.25 * params.dt * w);
    let way = select(product(q, turn), product(turn, q), spins_in_scene(here.inverse_moments));
    return way + (0.5 * attitude_defect(attitude[c], attitude_residue_of(c))) * q;
}

/// A clump moves and turns for a step with these velocities.
fn move_clump(c: u32, here: Clump, v: Vec, w: Spin) {
    let point = wrapped(moved(here.center.x, here.center.residue, params.dt * v));
    center_next[c] = point.x;
    keep_center_residue(c, point.residue);
    clump_motion_next[c] = Motion(v, here.motion.inverse_mass);
    clump_spin_next[c] = w;
    let next = turned_on(attitude[c], attitude_residue_of(c), attitude_step(c, here, w));
    attitude_next[c] = next.q;
    keep_attitude_residue(c, next.residue);
}

/// A member comes to where its clump is, with the velocity of the middle of the step, when the arm was the mean of what it was and
/// is. As `arrive`.
fn follow_clump(i: u32) -> bool {
    let label = number[i];
    let c = owner[label];
    let before = attitude[c] + attitude_residue_of(c);
    let motion = clump_motion_next[c];
    // The turn about its own axis leaves the spin as it is.
    let spin = global_spin(inverse_moments[c], before, clump_spin_next[c]);
    let arm = arm_of(before, label);
    let gain = arm_gain(attitude_gain(0.25 * params.dt * spin), arm);
    motion_next[i] = Motion(motion.v + surface_velocity(spin, arm + 0.5 * gain), motion.inverse_mass);
    keep_spin(i, spin);
    let center = Point(center_next[c], center_residue_next_of(c));
    let point = wrapped(carried(center, attitude_next[c], attitude_residue_next_of(c), unpacked(offset[label])));
    let way = params.dt * motion.v + gain;
    return arrive(i, place[i], residue_of(i), point, sqrt(dot(way, way)), false);
}

/// What a free clump has by itself, as `energies`.
fn energies_of_clump(c: u32) -> Energies {
    let here = clump(c);
    let inverse_mass = here.motion.inverse_mass;
    if (inverse_mass == 0) {
        return Energies();
    }
    let all = contacts_of_clump(c, here.attitude);
    let v = velocity_now(here.motion, all.force);
    let w = spin_of_clump_now(c, here, all.torque);
    let kinetic = 0.5 * dot(v, v) / inverse_mass + turning_energy(here, own_spin(here, w));
    let potential = -dot(params.gravity, here.center.x + here.center.residue) / inverse_mass;
    let total = all.force + params.gravity / inverse_mass;
    let spin = global_spin(here.inverse_moments, here.attitude, w);
    // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
    let dissipation = 2 * params.damping * kinetic + dashpots_late(c, here.attitude, v, spin);
    return Energies(kinetic, potential, sqrt(dot(total, total)), dissipation);
}

/// A clump and its members have these velocities next, where they are.
fn set_motion(c: u32, here: Clump, v: Vec, w: Spin) {
    clump_motion_next[c] = Motion(v, here.motion.inverse_mass);
    clump_spin_next[c] = w;
    let spin = global_spin(here.inverse_moments, here.attitude, w);
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        motion_next[i] = Motion(v + surface_velocity(spin, arm_of(here.attitude, label)), here.motion.inverse_mass);
        keep_spin(i, spin);
    }
}
