// twin: src/space/walls.rs
// Walls slot: planes and vertical cylinders. In the lists, wall w is neighbour number bodies + w, so that it shares
// contact law, history and replay with the grains. Owns the walls.

struct Wall {
    point: Vec,    // m: a point of the plane, or of the axis
    low: Vec,      // m: what the point has beyond
    normal: Vec,   // plane: unit vector towards the grains
    normal_low: Vec, // what it has beyond
    velocity: Vec, // m/s
    radius: Real,  // m: of the cylinder; 0 marks a plane
    radius_low: Real, // m: what it has beyond
    growth: Real,  // m/s: of the radius
    velocity_next: Vec, // m/s: both in the next step, if a servo moves the wall
    growth_next: Real,
    driven: u32,   // 1 if a servo moves it
    spin: Spin,    // rad/s: of the cylinder about its axis, and of a wall that turns
}

var<storage, read_write> wall: array<Wall>; // walls

/// Gap and normal from a grain to a wall.
fn wall_separation(w: u32, here: Position, low: PositionLow) -> Separation {
    let s = wall[w];
    let d = here.x - s.point;
    let rest = low.x - s.low;
    if (s.radius == 0) {
        let gap = gap_to_plane(d, rest, s.normal, s.normal_low, here.radius, low.radius);
        return Separation(gap, -s.normal);
    }
    let arm = horizontal(d + rest);
    let distance = sqrt(dot(arm, arm));
    let gap = gap_in_cylinder(
        horizontal(d),
        horizontal(rest),
        distance,
        s.radius,
        s.radius_low,
        here.radius,
        low.radius,
    );
    return Separation(gap, outward(arm));
}

/// Whether the centre of a grain is further beyond a wall than any impact of the scene drives it.
fn is_crossed(gap: Real, radius: Real) -> bool {
    return gap < -radius - params.wall_depth;
}

/// The direction from the axis to the end of an arm.
fn outward(arm: Real2) -> Vec {
    let distance = sqrt(dot(arm, arm));
    if (distance == 0) {
        return first_axis();
    }
    return from_horizontal(arm / distance);
}

/// A wall after a step with its velocity, of a cylinder also that of its radius. Those of a servo are taken over here, not
/// before, because contacts in the step see how the wall has come to where it is.
fn moved(before: Wall) -> Wall {
    var next = before;
    if (before.driven != 0u) {
        next.velocity = before.velocity_next;
        next.growth = before.growth_next;
    }
    let start = requantised(before.point, before.low);
    let point = displaced(start.x, start.low, params.dt * next.velocity);
    next.point = point.x;
    next.low = point.low;
    if (before.driven != 0u && before.radius != 0) {
        let radius = requantised(Vec(before.radius), Vec(before.radius_low));
        let grown = displaced(radius.x, radius.low, Vec(params.dt * next.growth));
        next.radius = grown.x.x;
        next.radius_low = grown.low.x;
    }
    return next;
}
