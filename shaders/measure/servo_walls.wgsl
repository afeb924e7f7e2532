// twin: src/measure/servo_walls.rs
// The servo of walls: velocities of planes along their normals, and of the radii of cylinders, that are to bring what
// presses on them to a target. They are what would take away the difference within the servo's time if nothing but the
// contacts at the wall gave way. These are stiffer than they are with the bed behind them, so that the force comes to its
// target from one side.
var<storage, read> halt: u32;
var<storage, read> wall_servo: array<WallServo>; // walls

struct WallServo {
    along: Vec,            // m/s, the velocity that the wall has besides
    force: Real,           // N, target
    pressure: Real,        // Pa (N/m), target; one of the two is 0
    factor: Real,          // of the area, before breadth and depth
    breadth: Real,         // m
    depth: Real,           // m, in space
    breadth_from: u32,     // instead: from this wall
    breadth_to: u32,       // to this one, of a cylinder to itself the radius; or NONE
    depth_from: u32,
    depth_to: u32,
    time: Real,            // s
    most_speed: Real,      // m/s
    least_stiffness: Real, // N/m, that contacts are taken for
    least_radius: Real,    // m, a cylinder does not close beyond it
}

struct Pressing {
    force: Real,
    stiffness: Real,
}

const LANES = 256u;

var<workgroup> of_lane: array<Pressing, LANES>;

@compute @workgroup_size(LANES)
fn servo_walls(@builtin(local_invocation_index) lane: u32) {
    let due = is_servo_due(halt);
    for (var w = 0u; w < params.walls; w++) {
        let looks = due && wall[w].driven != 0u;
        let rows = select(0u, params.partial_sums_len, looks);
        var sum = Pressing();
        for (var p = lane; p < rows; p += LANES) {
            let row = wall_load_sums[p * params.walls + w];
            sum.force += row.normal_force;
            sum.stiffness += row.stiffness;
        }
        of_lane[lane] = sum;
        workgroupBarrier();
        if (lane == 0u && looks) {
            for (var l = 1u; l < LANES; l++) {
                sum.force += of_lane[l].force;
                sum.stiffness += of_lane[l].stiffness;
            }
            drive(w, sum);
        }
        workgroupBarrier();
    }
}

/// Let a wall on which this presses move towards its target.
fn drive(w: u32, now: Pressing) {
    let servo = wall_servo[w];
    let missing = (servo.force + servo.pressure * area_of(servo)) - now.force;
    let resistance = servo.time * max(now.stiffness, servo.least_stiffness);
    let speed = clamp(missing / resistance, -servo.most_speed, servo.most_speed);
    if (wall[w].radius == 0) {
        wall[w].velocity_next = servo.along + speed * wall[w].normal;
        return;
    }
    let least = select(-servo.most_speed, Real(0), wall[w].radius <= servo.least_radius);
    wall[w].growth_next = max(-speed, least);
}

fn area_of(servo: WallServo) -> Real {
    let breadth = servo.factor * wall_distance(servo.breadth, servo.breadth_from, servo.breadth_to);
    if (DIMENSIONS == 2u) {
        return breadth;
    }
    return breadth * wall_distance(servo.depth, servo.depth_from, servo.depth_to);
}

/// A length, or how far it is from one wall to another.
fn wall_distance(length: Real, begin: u32, end: u32) -> Real {
    if (begin == NONE) {
        return length;
    }
    let a = wall[begin];
    if (begin == end) {
        return a.radius + a.radius_low;
    }
    return dot((wall[end].point - a.point) + (wall[end].low - a.low), a.normal);
}
