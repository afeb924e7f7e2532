// twin: src/laws/grains.rs
// Grains slot: bodies are the members of clumps, rigid sets of spheres or disks. Contacts are those of members; a clump gathers
// what acts on its members, moves by (2.19)-(2.32) and turns by (2.40), and its members follow from where it is. They are never
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
var<storage, read_write> pull: array<Vec>;                  // N, N: force of all contacts of a member
var<storage, read_write> twist: array<Spin>;                // N, N m: their moment about the member's centre
var<storage, read_write> rounds: Rounds;

/// How hard the predictor-corrector had to work.
struct Rounds {
    most: atomic<u32>,   // rounds of a step of a clump
    capped: atomic<u32>, // steps of clumps that ended before they met the tolerance
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

/// Nothing: a member has no energy by itself, see `measure_clumps`.
fn energies(here: Body, sum: Gathered, drag: Vec) -> Energies {
    return Energies();
}

/// Whether no product of angular velocities turns up in (2.21)-(2.23). Such a clump spins along the axes of the scene, like a
/// sphere, and so does a fixed one.
fn is_round(inverse_moments: Spin) -> bool {
    return all_equal(inverse_moments);
}

/// Spin along the axes of the scene, rad/s.
fn global_spin(inverse_moments: Spin, q: Attitude, w: Spin) -> Spin {
    if (is_round(inverse_moments)) {
        return w;
    }
    return turned_spin(q, w);
}

/// From the centre of the clump to a member, m.
fn arm_of(q: Attitude, label: u32) -> Vec {
    return turned(q, unpacked(offset[label]));
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

/// Angular acceleration (2.21)-(2.23) without damping, rad/s².
fn spin_acceleration(here: Clump, w: Spin, torque: Spin) -> Spin {
    return here.inverse_moments * (torque + gyroscopic(w, here.inverse_moments));
}

/// Δω of a step, rad/s, and the rounds that it took.
struct Gain {
    spin: Spin,
    rounds: u32,
    settled: bool,
}

/// Rounds of predictor and corrector (2.24)-(2.31), until none changes Δω by more than this part of ω. The torque is along the
/// principal axes. Damping is solved for, as in (2.19), so that the iteration has to find the products of ω alone.
fn gained(here: Clump, torque: Spin, before: Spin) -> Gain {
    var gain = before;
    var count = 0u;
    var settled = false;
    while (!settled && count < MOST_ROUNDS) {
        let predicted = spin_gained(here.spin, spin_acceleration(here, here.spin + 0.5 * gain, torque));
        gain = spin_gained(here.spin, spin_acceleration(here, here.spin + 0.5 * predicted, torque));
        count++;
        let scale = max(largest(here.spin), largest(gain));
        settled = !(largest(gain - predicted) > SPIN_TOLERANCE * scale);
    }
    return Gain(gain, count, settled);
}

/// A step that is not settled after so many rounds is counted.
const MOST_ROUNDS = 25u;

/// The moment along the axes in which the clump spins.
fn own_torque(here: Clump, torque: Spin) -> Spin {
    return turned_spin(conjugate(here.attitude), torque);
}

/// Spin at step n, rad/s, in the axes in which the clump spins; the torque is along those of the scene.
fn spin_of_clump_now(c: u32, here: Clump, torque: Spin) -> Spin {
    if (!is_round(here.inverse_moments)) {
        return here.spin + 0.5 * gained(here, own_torque(here, torque), spin_gain[c]).spin;
    }
    if (here.motion.inverse_mass == 0) {
        return here.spin;
    }
    return half_spun(here.spin, here.inverse_moments * torque);
}

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those of the
/// body from the right. What rounding has done to its length is undone.
fn attitude_step(c: u32, here: Clump, w: Spin) -> Attitude {
    let q = here.attitude;
    let turn = attitude_gain(0.25 * params.dt * w);
    let way = select(product(q, turn), product(turn, q), is_round(here.inverse_moments));
    return way + (0.5 * attitude_defect(attitude[c], attitude_residue_of(c))) * q;
}

/// What a free clump has by itself, as `energies`.
fn energies_of_clump(c: u32) -> Energies {
    let here = clump(c);
    let inverse_mass = here.motion.inverse_mass;
    if (inverse_mass == 0) {
        return Energies();
    }
    let all = contacts_of_clump(c, here.attitude);
    let v = at_step(here.motion, all.force);
    let w = spin_of_clump_now(c, here, all.torque);
    let kinetic = 0.5 * dot(v, v) / inverse_mass + 0.5 * spin_dot(w, w / here.inverse_moments);
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
