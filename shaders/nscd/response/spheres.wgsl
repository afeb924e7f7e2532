// twin: src/nscd/response.rs
// Contact dynamics of spheres and disks: every body answers to the impulses of its own contacts.

/// Body i at the end of the step if nothing touched it.
fn free_motion(i: u32) -> FreeMotion {
    let now = velocity[i];
    let w = spin_of(i);
    let low = velocity_low_of(i);
    let spin = w + (spin_low_of(w, low.spin) + free_spin_change(now, w));
    return FreeMotion(now.v, low_of(now.v, low.v) + free_velocity_change(now), spin);
}

/// The number of the grain that body i is.
fn grain_of(i: u32) -> u32 {
    return id[i];
}

/// The body that stands for the grain of body i while sweeps go on.
fn standing_for(i: u32) -> u32 {
    return i;
}

/// What an impulse does to a point of body i at most, along the normal and across, 1/kg.
fn largest_response(i: u32) -> UpdateScales {
    let inverse_mass = impulse_inverse_mass(i);
    let radius = position[i].radius;
    return UpdateScales(inverse_mass, inverse_mass + radius * radius * inverse_inertia(position[i], inverse_mass));
}

/// What an impulse does to bodies i and j at an entry; j may be a wall. Both get the same bits, because the body with the
/// smaller index comes first.
fn inverse_effective_mass_of(entry: u32, i: u32, j: u32, touch: Separation) -> InverseEffectiveMass {
    var inverse_mass = InverseEffectiveMass();
    let own = impulse_inverse_mass(i);
    inverse_mass.arm = position[i].radius + 0.5 * touch.gap;
    inverse_mass.normal = own;
    let arm = inverse_mass.arm;
    let turning = arm * arm * inverse_inertia(position[i], own);
    var turning_to = Real(0);
    if (j < params.bodies) {
        let other = impulse_inverse_mass(j);
        inverse_mass.arm_to = position[j].radius + 0.5 * touch.gap;
        inverse_mass.normal += other;
        let arm_to = inverse_mass.arm_to;
        turning_to = arm_to * arm_to * inverse_inertia(position[j], other);
    }
    let first = i < j;
    let rotational = select(turning_to, turning, first) + select(turning, turning_to, first);
    inverse_mass.tangential = inverse_mass.normal + rotational;
    return inverse_mass;
}

/// The largest eigenvalue of W_kk + C, 1/kg.
fn natural_map_scale(entry: u32, side: OrientedContact, compliance: UpdateScales) -> Real {
    return max(side.normal, side.tangential);
}

/// Velocity and spin that impulses give body i.
struct Response {
    velocity: Velocity,
    spin: Spin,
    inertia: Real, // its inverse, 1/(kg m²)
}

fn response(i: u32, sum: ForceTorque) -> Response {
    let inverse_mass = impulse_inverse_mass(i);
    let inertia = inverse_inertia(position[i], inverse_mass);
    return Response(Velocity(inverse_mass * sum.force, inverse_mass), inertia * sum.torque, inertia);
}

/// A step begins with the impulses of the last one, `contacts` of them.
fn respond_to_warm_start(i: u32, sum: ForceTorque, contacts: u32) -> ResidualSums {
    let start = response(i, sum);
    pass_velocity[i] = start.velocity;
    pass_velocity_before[i] = start.velocity;
    extrapolated_velocity[i] = start.velocity;
    store_pass_spin(i, start.spin);
    store_pass_spin_before(i, start.spin);
    store_extrapolated_spin(i, start.spin);
    var sums = ResidualSums();
    sums.lipschitz_bound = Real(contacts);
    return sums;
}

/// A pass that started from these velocities has left these impulses. Work of the change, J.
fn respond_to_pass(i: u32, sum: ForceTorque, here: Velocity, spin: Spin) -> Real {
    let next = response(i, sum);
    pass_velocity_before[i] = next.velocity;
    store_pass_spin_before(i, next.spin);
    return kinetic_metric(next.velocity.v - here.v, next.velocity.inverse_mass, next.spin - spin, next.inertia);
}

/// A pass of the power iteration from these velocities has left these impulses: they alone give velocities. Work, J.
fn respond_to_power_iteration(i: u32, sum: ForceTorque, here: Velocity, spin: Spin) -> Real {
    let next = response(i, sum);
    pass_velocity[i] = next.velocity;
    store_pass_spin(i, next.spin);
    return kinetic_metric(here.v, here.inverse_mass, spin, next.inertia);
}

/// A body as a contact of a colour holds it.
struct ContactBody {
    velocity: Velocity,
    spin: Spin,
    arm: Vec, // m, from the body's centre to the contact point
}

/// Body i with the velocities that sweeps have left it, at the end of an arm from its centre.
fn contact_body(i: u32, arm: Vec) -> ContactBody {
    return ContactBody(extrapolated_velocity[i], extrapolated_spin_of(i), arm);
}

/// An impulse there.
fn apply_impulse(i: u32, body: ContactBody, impulse: Vec) {
    let inverse_mass = body.velocity.inverse_mass;
    let inertia = inverse_inertia(position[i], inverse_mass);
    extrapolated_velocity[i] = Velocity(body.velocity.v + inverse_mass * impulse, inverse_mass);
    store_extrapolated_spin(i, body.spin + inertia * moment(body.arm, impulse));
}

/// A sweep has led body i from where it set out to where it is: how far against the way from the pass before, J.
fn respond_to_sweep(i: u32) -> Real {
    return respond_to_swept(i, extrapolated_velocity[i], extrapolated_spin_of(i));
}

/// The same if these impulses come to it in the end.
fn respond_to_large_contacts(i: u32, sum: ForceTorque) -> Real {
    let before = extrapolated_velocity[i];
    let last = response(i, sum);
    let now = Velocity(before.v + last.velocity.v, before.inverse_mass);
    return respond_to_swept(i, now, extrapolated_spin_of(i) + last.spin);
}

fn respond_to_swept(i: u32, now: Velocity, spin: Spin) -> Real {
    var against = Real(0);
    let last = pass_velocity[i].v;
    if (now.inverse_mass != 0) {
        let start = last + solver_state.beta * (last - pass_velocity_before[i].v);
        against = dot(start - now.v, now.v - last) / now.inverse_mass;
    }
    let inertia = inverse_inertia(position[i], now.inverse_mass);
    if (inertia != 0) {
        let spin_last = pass_spin_of(i);
        let start = spin_last + solver_state.beta * (spin_last - pass_spin_before_of(i));
        against += spin_dot(start - spin, spin - spin_last) / inertia;
    }
    pass_velocity_before[i] = now;
    store_pass_spin_before(i, spin);
    return against;
}

/// What passes have left is freed of its rounding. `load`: of all contacts, N s.
fn respond_to_gather(i: u32, sum: ForceTorque, load: Real) {
    let now = response(i, sum);
    remove_rounding(i, now.velocity, now.spin);
    load_speed[i] = load * largest_response(i).tangential;
}

/// Kinetic energy, twice, J.
fn kinetic_metric(v: Vec, inverse_mass: Real, w: Spin, inertia: Real) -> Real {
    var twice = Real(0);
    if (inverse_mass != 0) {
        twice = dot(v, v) / inverse_mass;
    }
    if (inertia != 0) {
        twice += spin_squared(w) / inertia;
    }
    return twice;
}
