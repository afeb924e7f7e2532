// twin: src/body/bodies.rs
// The grains, in the order of the cells at the last rebuild. What a kernel changes it writes to an array of the same
// name and `_next`; the plan then exchanges the two.
var<storage, read> position: array<Position>;   // N, at step n
var<storage, read> velocity: array<Velocity>; // N, at n - 1/2
var<storage, read> id: array<u32>;    // N: the grain's number in the scene
var<storage, read_write> index_of_id: array<u32>; // N, by number: where the grain is
var<storage, read_write> position_next: array<Position>;   // N
var<storage, read_write> velocity_next: array<Velocity>; // N
var<storage, read_write> displacement: array<Real>;        // N, m: way since the lists were made

/// All there is to know of a grain.
struct Body {
    position: Position,
    low: PositionLow,
    velocity: Velocity,
    spin: Spin,
}

fn body(i: u32) -> Body {
    return Body(position[i], position_low_of(i), velocity[i], spin_of(i));
}

/// Grain i has come to this point by a way of this length, m. Whether the lists may miss a neighbour of it from now on,
/// or the grain is lost: beyond the domain, too fast to be followed, or for what the caller has found (`hopeless`).
fn commit_position(i: u32, position: Position, low: PositionLow, point: Point, stride: Real, hopeless: bool) -> bool {
    position_next[i] = Position(point.x, position.radius);
    store_position_low(i, PositionLow(point.low, low.radius));
    let way = displacement[i] + stride;
    displacement[i] = way;
    let lost = hopeless || outside(point.x, params.lower, params.upper) || !(stride <= params.step_limit);
    if (lost) {
        atomicMax(&counters.lost_body, params.bodies - id[i]);
    }
    return lost || !(way <= params.displacement_limit);
}

/// Grain i changes its velocity and its spin by this much; its velocity then, m/s.
fn change_velocities(i: u32, here: Body, change: Vec, spin_change: Spin) -> Vec {
    let low = velocity_low_of(i);
    let v = accelerated(here.velocity.v, low.v, change);
    let w = accelerated_spin(here.spin, low.spin, spin_change);
    velocity_next[i] = Velocity(v.v, here.velocity.inverse_mass);
    store_spin(i, w.spin);
    store_velocity_low(i, VelocityLow(v.low, w.low));
    return v.v;
}

/// Force and moment of all contacts of a grain.
struct ForceTorque {
    force: Vec,
    torque: Spin,
}
