// twin: src/body/grains.rs
// Grains slot: bodies are the members of clumps, rigid sets of spheres or disks. Contacts are those of members; a clump
// gathers what acts on its members, moves and turns by (2.40), and its members follow from where it is. They are never
// moved on their own, so they cannot drift apart. Owns the clumps, in the order of the scene.

var<storage, read> clump_of_id: array<u32>;                    // N, by number: the member's clump
var<storage, read> member_offset: array<Packed>;               // N, by number, m: from the clump's centre, in its axes
var<storage, read> first_member: array<u32>;                   // C + 1: number of a clump's first member
var<storage, read> inverse_moments: array<Spin>;               // C, 1/(kg m²), 1/J1, 1/J2, 1/J3; 0 of a fixed clump
var<storage, read> center: array<Vec>;                         // C, m, centre of mass, at step n
var<storage, read_write> center_next: array<Vec>;              // C
var<storage, read> orientation: array<Orientation>;            // C, from its principal axes to x, y, z, at step n
var<storage, read_write> orientation_next: array<Orientation>; // C
var<storage, read> clump_velocity: array<Velocity>;            // C, at n - 1/2
var<storage, read_write> clump_velocity_next: array<Velocity>; // C
var<storage, read> clump_spin: array<Spin>;                    // C, rad/s, at n - 1/2, see `spins_in_scene`
var<storage, read_write> clump_spin_next: array<Spin>;         // C
var<storage, read_write> spin_increment: array<Spin>;          // C, rad/s: Δω of the last step, the next prediction
var<storage, read_write> member_force: array<Vec>;             // N, N; N s in contact dynamics: of a member's contacts
var<storage, read_write> member_torque: array<Spin>;           // N, N m or N m s: their moment about its centre
var<storage, read_write> rotation_iterations: RotationIterations;

/// How hard the iterations for the rotation had to work.
struct RotationIterations {
    most: atomic<u32>,   // rounds of a step of a clump
    capped: atomic<u32>, // steps of clumps that ended before they met the tolerance
}

/// A step that is not settled after so many rounds is counted.
const MAX_ITERATIONS = 25u;

/// Δω of a step, rad/s, and the rounds that it took.
struct SpinIncrement {
    spin: Spin,
    rounds: u32,
    settled: bool,
}

/// Whether rounds that look for the change of a spin have found it: the last of them has moved it by a small part of
/// itself only, or by no less than the round before and by what the rounding of the spin may do. Errors that were small
/// beside the spin, and not beside its change, would take energy, in every step the same way.
fn has_settled(moved: Real, moved_before: Real, change: Spin, spin: Spin) -> bool {
    let small = SPIN_TOLERANCE * max(largest(change), SMALL_CHANGE * largest(spin));
    let rounding = SPIN_TOLERANCE * max(largest(change), largest(spin));
    return !(moved > small) || (!(moved < moved_before) && !(moved > rounding));
}

/// Of a spin: below it no change is found with more digits.
const SMALL_CHANGE: Real = 1e-3;

/// A step of a clump has taken this many.
fn count_iterations(count: u32, settled: bool) {
    if (count > atomicLoad(&rotation_iterations.most)) {
        atomicMax(&rotation_iterations.most, count);
    }
    if (!settled) {
        atomicAdd(&rotation_iterations.capped, 1u);
    }
}

/// All there is to know of a clump.
struct Clump {
    center: Point,
    orientation: Orientation,
    velocity: Velocity,
    spin: Spin,
    inverse_moments: Spin,
}

fn clump(c: u32) -> Clump {
    let center = Point(center[c], center_low_of(c));
    return Clump(center, orientation[c] + orientation_low_of(c), clump_velocity[c], clump_spin[c], inverse_moments[c]);
}

/// Whether bodies i and j belong to one grain.
fn same_grain(i: u32, j: u32) -> bool {
    return clump_of_id[id[i]] == clump_of_id[id[j]];
}

/// Nothing: members get their velocities from their clump, anew in every step.
fn permute_velocity_low(i: u32, old: u32) {}

/// How many bodies the grain of body i has.
fn member_count(i: u32) -> u32 {
    let c = clump_of_id[id[i]];
    return first_member[c + 1u] - first_member[c];
}

/// One of them.
fn member_of(i: u32, m: u32) -> u32 {
    return index_of_id[first_member[clump_of_id[id[i]]] + m];
}

/// Spin along the axes of the scene, rad/s.
fn global_spin(inverse_moments: Spin, q: Orientation, w: Spin) -> Spin {
    if (spins_in_scene(inverse_moments)) {
        return w;
    }
    return rotate_spin(q, w);
}

/// The same spin along the principal axes, rad/s.
fn own_spin(here: Clump, w: Spin) -> Spin {
    if (!spins_in_scene(here.inverse_moments)) {
        return w;
    }
    return rotate_spin(conjugate(here.orientation), w);
}

/// From the centre of the clump to a member, m.
fn arm_of(q: Orientation, member_id: u32) -> Vec {
    return rotate(q, unpacked(member_offset[member_id]));
}

/// From the centre of the clump of body i to the body, m.
fn arm_in_grain(i: u32) -> Vec {
    let c = clump_of_id[id[i]];
    return arm_of(orientation[c] + orientation_low_of(c), id[i]);
}

/// Force and moment, about the clump's centre, of what `member_force` and `member_torque` hold for its members.
fn clump_load(c: u32, q: Orientation) -> ForceTorque {
    var sum = ForceTorque();
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let force = member_force[i];
        sum.force += force;
        sum.torque += member_torque[i] + moment(arm_of(q, member_id), force);
    }
    return sum;
}

/// How far the attitude turns in a step (2.40): a turn about the axes of the scene comes from the left, one about those
/// of the body from the right. What rounding has done to its length is undone.
fn orientation_increment(c: u32, here: Clump, w: Spin) -> Orientation {
    let q = here.orientation;
    let turn = rotation_increment(0.25 * params.dt * w);
    let in_scene = spins_in_scene(here.inverse_moments);
    let increment = select(quaternion_product(q, turn), quaternion_product(turn, q), in_scene);
    return increment + (0.5 * norm_defect(orientation[c], orientation_low_of(c))) * q;
}

/// A clump changes its velocities by this much, and moves and turns for a step with them.
fn move_clump(c: u32, here: Clump, change: Vec, spin_change: Spin) {
    let low = clump_velocity_low_of(c);
    let v = accelerated(here.velocity.v, low.v, change);
    let w = accelerated_spin(here.spin, low.spin, spin_change);
    let start = requantised(here.center.x, here.center.low);
    let point = wrap(displaced(start.x, start.low, params.dt * carried(start.x, v.v)));
    center_next[c] = point.x;
    store_center_low(c, point.low);
    store_clump_velocity(c, here, v, w);
    let increment = orientation_increment(c, here, w.spin);
    let next = add_rotation(orientation[c], orientation_low_of(c), orientation_rest_of(c), increment);
    orientation_next[c] = next.q;
    store_orientation_low(c, next.low);
    store_orientation_rest(c, next.rest);
}

/// A member comes to where its clump is, with the velocity of the middle of the step, when the arm was the mean of what
/// it was and is. As `commit_position`.
fn place_member(i: u32) -> bool {
    let member_id = id[i];
    let c = clump_of_id[member_id];
    let before = orientation[c] + orientation_low_of(c);
    let velocity = clump_velocity_next[c];
    // The turn about its own axis leaves the spin as it is.
    let spin = global_spin(inverse_moments[c], before, clump_spin_next[c]);
    let arm = arm_of(before, member_id);
    let gain = arm_increment(rotation_increment(0.25 * params.dt * spin), arm);
    let middle = arm + 0.5 * gain;
    velocity_next[i] = Velocity(past_next_flow(velocity.v + surface_velocity(spin, middle), middle), velocity.inverse_mass);
    store_spin(i, spin);
    let center = Point(center_next[c], center_low_next_of(c));
    let offset = unpacked(member_offset[member_id]);
    let point = wrap(arm_end(center, orientation_next[c], orientation_low_next_of(c), offset));
    let way = params.dt * velocity.v + gain;
    let stride = approach(sqrt(dot(way, way)), position[i].radius + sqrt(dot(arm, arm)));
    let turn = params.dt * sqrt(spin_squared(spin));
    let hopeless = !(turn <= params.turn_limit);
    return commit_position(i, position[i], position_low_of(i), point, stride, hopeless);
}

/// A clump has these velocities next.
fn store_clump_velocity(c: u32, here: Clump, v: SplitVelocity, w: SplitSpin) {
    clump_velocity_next[c] = Velocity(v.v, here.velocity.inverse_mass);
    clump_spin_next[c] = w.spin;
    store_clump_velocity_low(c, VelocityLow(v.low, w.low));
}

/// And its members those that belong to them, where they are.
fn set_clump_velocity(c: u32, here: Clump, v: SplitVelocity, w: SplitSpin) {
    store_clump_velocity(c, here, v, w);
    let spin = global_spin(here.inverse_moments, here.orientation, w.spin);
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let arm = arm_of(here.orientation, member_id);
        let member_v = past_flow(v.v + surface_velocity(spin, arm), arm);
        velocity_next[i] = Velocity(member_v, here.velocity.inverse_mass);
        store_spin(i, spin);
    }
}

/// Force and moment, about the clump's centre, of all contacts of all its members. The springs stay as they are.
fn contacts_of_clump(c: u32, q: Orientation) -> ForceTorque {
    var sum = ForceTorque();
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        let member = contacts_of(i, body(i));
        sum.force += member.force;
        sum.torque += member.torque + moment(arm_of(q, member_id), member.force);
    }
    return sum;
}
