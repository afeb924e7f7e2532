// twin: src/nscd/move_spheres.rs
// Contact dynamics 8: the end of a step, positions n to n + 1 with the velocities n + 1.
var<storage, read_write> halt: atomic<u32>;

/// The impulses that the step ends with; what carries one is a contact of the next step.
fn impulses_of(i: u32, entries: vec2<u32>) -> ListSums {
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let impulse = impulse_of(entry);
        set_active(entry, tagged, any(impulse != Vec()));
        remember_spring(entry, impulse);
        total.impulse = with_impulse(total.impulse, entry, impulse);
    }
    return total;
}

/// Body i has got these impulses.
fn move_sphere(i: u32, sum: ForceTorque) {
    let here = body(i);
    // From the impulses, and not from the velocities of the last pass, which have no digits for a small change.
    let inverse_mass = damping_factor() * here.velocity.inverse_mass;
    let change = free_velocity_change(here.velocity) + inverse_mass * sum.force;
    let spin_change =
        free_spin_change(here.velocity, here.spin) + inverse_inertia(here.position, inverse_mass) * sum.torque;
    let v = change_velocities(i, here, change, spin_change);
    let point = wrap(displaced(here.position.x, here.low.x, params.dt * carried(here.position.x, v)));
    let stride = approach(params.dt * sqrt(dot(v, v)), here.position.radius);
    if (commit_position(i, here.position, here.low, point, stride, false)) {
        atomicMax(&halt, HALTED); // the host will take the step back, and walls must not have moved
    }
}

@compute @workgroup_size(GROUP)
fn move_spheres(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, impulses_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    // A step without grains is one, too.
    if (number_of(workgroup, workgroups) == 0u && lane == 0u) {
        atomicAdd(&counters.steps_done, 1u);
    }
    if (walk.answers) {
        move_sphere(walk.body, total.impulse);
    }
}
