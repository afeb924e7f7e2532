// twin: src/nscd/response.rs
// Contact dynamics of clumps: members hand the impulses of their contacts to their clump, which answers with its full
// inertia, and get the velocities of its surface. So a contact sees members only, as in the discrete element method,
// but for sweeps by colours. From `free_velocities` to `move_clumps` `clump_velocity_next` and `clump_spin_next` have by
// how much velocities would change in the step if nothing touched.

var<storage, read_write> delassus_eigenvalue: array<Real>;      // entries, 1/kg: largest eigenvalue of W_kk
var<storage, read_write> response: array<Velocity>;    // N, m/s, 1/kg: what members get from their clumps
var<storage, read_write> response_spin: array<Spin>; // N, rad/s

/// Body i at the end of the step if nothing touched its clump.
fn free_motion(i: u32) -> FreeMotion {
    let member_id = id[i];
    let c = clump_of_id[member_id];
    let now = clump_velocity[c];
    let w = clump_spin[c];
    let low = clump_velocity_low_of(c);
    let spin = w + (spin_low_of(w, low.spin) + clump_spin_next[c]);
    let arm = arm_of(orientation[c] + orientation_low_of(c), member_id);
    let surface = past_flow(surface_velocity(spin, arm), arm);
    return FreeMotion(now.v, low_of(now.v, low.v) + clump_velocity_next[c].v + surface, spin);
}

/// The number of the grain that body i belongs to.
fn grain_of(i: u32) -> u32 {
    return clump_of_id[id[i]];
}

/// The body that stands for the grain of body i while sweeps go on: the first member of its clump.
fn standing_for(i: u32) -> u32 {
    return index_of_id[first_member[clump_of_id[id[i]]]];
}

/// What an impulse does to a point of body i at most, along the normal and across, 1/kg.
fn largest_response(i: u32) -> UpdateScales {
    let offset = unpacked(member_offset[id[i]]);
    let reach = sqrt(dot(offset, offset)) + position[i].radius;
    let turning = damping_factor() * largest(inverse_moments[clump_of_id[id[i]]]);
    let most = impulse_inverse_mass(i) + reach * reach * turning;
    return UpdateScales(most, most);
}

/// Velocity, m/s, of the point at the end of an arm from body i for an impulse there of 1 N s along each axis.
fn delassus_block(i: u32, arm: Vec) -> Columns {
    let member_id = id[i];
    let c = clump_of_id[member_id];
    let q = orientation[c] + orientation_low_of(c);
    let turning = rotational_block(q, damping_factor() * inverse_moments[c], arm_of(q, member_id) + arm);
    return plus(turning, impulse_inverse_mass(i), identity());
}

/// What an impulse does to bodies i and j, which have met at an entry; j may be a wall. Keeps the entry's largest
/// eigenvalue of the Delassus block. Both get the same bits, because the body with the smaller index comes first.
fn inverse_effective_mass_of(entry: u32, i: u32, j: u32, touch: Separation) -> InverseEffectiveMass {
    var inverse_mass = InverseEffectiveMass();
    inverse_mass.arm = position[i].radius + 0.5 * touch.gap;
    let n = touch.n;
    let first = i < j;
    let arm = inverse_mass.arm * n;
    var arm_to = Vec();
    var w = Columns();
    if (j < params.bodies) {
        inverse_mass.arm_to = position[j].radius + 0.5 * touch.gap;
        arm_to = -inverse_mass.arm_to * n;
        w = delassus_block(select(i, j, first), select(arm, arm_to, first));
    }
    w = plus(delassus_block(select(j, i, first), select(arm_to, arm, first)), 1, w);
    let scales = update_scales(w, n, pair_of(i, j).friction);
    inverse_mass.normal = scales.normal;
    inverse_mass.tangential = scales.tangential;
    delassus_eigenvalue[entry] = largest_eigenvalue(w);
    return inverse_mass;
}

/// The largest eigenvalue of W_kk + C, 1/kg, or more.
fn natural_map_scale(entry: u32, side: OrientedContact, compliance: UpdateScales) -> Real {
    return delassus_eigenvalue[entry] + max(compliance.normal, compliance.tangential);
}

/// The clump will answer.
fn store_member_load(i: u32, sum: ForceTorque) {
    member_force[i] = sum.force;
    member_torque[i] = sum.torque;
}

fn respond_to_warm_start(i: u32, sum: ForceTorque, contacts: u32) -> ResidualSums {
    store_member_load(i, sum);
    return ResidualSums();
}

fn respond_to_pass(i: u32, sum: ForceTorque, here: Velocity, spin: Spin) -> Real {
    store_member_load(i, sum);
    return 0;
}

fn respond_to_power_iteration(i: u32, sum: ForceTorque, here: Velocity, spin: Spin) -> Real {
    store_member_load(i, sum);
    return 0;
}

/// A body as a contact of a colour holds it: by its clump, for all of which the first member stands while sweeps go on.
struct ContactBody {
    velocity: Velocity, // of the first member
    spin: Spin,
    arm: Vec,       // m, from the first member's centre to the contact point
    member_arm: Vec, // m, from the clump's centre to the first member's
    first: u32,     // index of the first member
    clump: u32,
    orientation: Orientation,
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
fn contact_body(i: u32, arm: Vec) -> ContactBody {
    let member_id = id[i];
    let c = clump_of_id[member_id];
    let q = orientation[c] + orientation_low_of(c);
    let first = index_of_id[first_member[c]];
    let member_arm = arm_of(q, first_member[c]);
    let from_first = (arm_of(q, member_id) + arm) - member_arm;
    return ContactBody(extrapolated_velocity[first], extrapolated_spin[first], from_first, member_arm, first, c, q);
}

/// An impulse there.
fn apply_impulse(i: u32, body: ContactBody, impulse: Vec) {
    let spin = spin_from(body.orientation, inverse_moments[body.clump], moment(body.member_arm + body.arm, impulse));
    let v = body.velocity.inverse_mass * impulse + surface_velocity(spin, body.member_arm);
    extrapolated_velocity[body.first] = Velocity(body.velocity.v + v, body.velocity.inverse_mass);
    extrapolated_spin[body.first] = body.spin + spin;
}

/// Members will get the velocities of the first of them.
fn respond_to_sweep(i: u32) -> Real {
    return 0;
}

/// The clump will answer.
fn respond_to_large_contacts(i: u32, sum: ForceTorque) -> Real {
    store_member_load(i, sum);
    return 0;
}

/// `load`: of all contacts, N s.
fn respond_to_gather(i: u32, sum: ForceTorque, load: Real) {
    store_member_load(i, sum);
    load_speed[i] = load * largest_response(i).tangential;
}

/// Spin that a moment, N m s, gives a clump, rad/s.
fn spin_from(q: Orientation, inverse_moments: Spin, torque: Spin) -> Spin {
    return damping_factor() * rotate_spin(q, inverse_moments * rotate_spin(conjugate(q), torque));
}

/// How a clump moves.
struct RigidVelocity {
    v: Vec,
    spin: Spin, // along the axes of the scene
}

/// The product of two of them, J, with the inertia that impulses act on: of one with itself, twice its kinetic energy.
fn kinetic_metric(here: Clump, a: RigidVelocity, b: RigidVelocity) -> Real {
    if (here.velocity.inverse_mass == 0) {
        return 0;
    }
    let turning = spin_dot(own_spin(here, a.spin), own_spin(here, b.spin) / here.inverse_moments);
    return (dot(a.v, b.v) / here.velocity.inverse_mass + turning) / damping_factor();
}

/// From a to b.
fn velocity_difference(a: RigidVelocity, b: RigidVelocity) -> RigidVelocity {
    return RigidVelocity(b.v - a.v, b.spin - a.spin);
}

/// What the impulses that its members hold add to how a clump moves.
fn impulse_response(c: u32, here: Clump) -> RigidVelocity {
    let sum = clump_load(c, here.orientation);
    let v = (damping_factor() * here.velocity.inverse_mass) * sum.force;
    return RigidVelocity(v, spin_from(here.orientation, here.inverse_moments, sum.torque));
}

/// How its surface moves where a member is.
fn member_velocity(here: Clump, velocity: RigidVelocity, member_id: u32) -> Velocity {
    let v = velocity.v + surface_velocity(velocity.spin, arm_of(here.orientation, member_id));
    return Velocity(v, damping_factor() * here.velocity.inverse_mass);
}

/// Members get the velocities of their clump's surface.
fn set_member_velocities(c: u32, here: Clump, velocity: RigidVelocity) {
    for (var member_id = first_member[c]; member_id < first_member[c + 1u]; member_id++) {
        let i = index_of_id[member_id];
        response[i] = member_velocity(here, velocity, member_id);
        response_spin[i] = velocity.spin;
    }
}

/// How a clump moves whose first member has these velocities.
fn from_first_member(c: u32, q: Orientation, first: Velocity, spin: Spin) -> RigidVelocity {
    return RigidVelocity(first.v - surface_velocity(spin, arm_of(q, first_member[c])), spin);
}

/// As a pass starts from it, or sweeps have left it.
fn extrapolated_clump(c: u32, q: Orientation) -> RigidVelocity {
    let i = index_of_id[first_member[c]];
    return from_first_member(c, q, extrapolated_velocity[i], extrapolated_spin[i]);
}

/// Nothing: spins are those of the positions.
fn clump_spin_change_now(c: u32, here: Clump, torque: Spin) -> Spin {
    return Spin();
}
