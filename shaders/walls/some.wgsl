// twin: src/laws/walls.rs
// Walls slot: planes and vertical cylinders. In the lists, wall w is neighbour number bodies + w, so that it shares
// contact law, history and replay with the grains. Owns the walls.

struct Wall {
    point: Vec,    // m: a point of the plane, or of the axis
    residue: Vec,  // m: what the point has beyond
    normal: Vec,   // plane: unit vector towards the grains
    velocity: Vec, // m/s
    radius: Real,  // m: of the cylinder; 0 marks a plane
    spin: Real,    // rad/s: of the cylinder about its axis
}

var<storage, read_write> wall: array<Wall>; // walls

/// Gap and normal from a grain to a wall.
fn touch_wall(w: u32, here: Place, residue: Residue) -> Touch {
    let s = wall[w];
    let d = here.x - s.point;
    let rest = residue.x - s.residue;
    if (s.radius == 0) {
        return Touch((dot(d, s.normal) - here.radius) + (dot(rest, s.normal) - residue.radius), -s.normal);
    }
    let arm = horizontal(d + rest);
    let distance = sqrt(dot(arm, arm));
    if (distance == 0) {
        return Touch(s.radius - here.radius, first_axis());
    }
    return Touch(((s.radius - distance) - here.radius) - residue.radius, from_horizontal(arm / distance));
}

/// The contact normal when the grain was at x_before, a step ago, for the rotation Z of the spring.
fn wall_normal_before(w: u32, x_before: Vec) -> Vec {
    return touch_wall(w, Place(x_before + params.since * wall[w].velocity, 0), Residue()).n;
}

/// Velocity of the wall's material at a point of its surface, m/s.
fn wall_velocity(w: u32, point: Vec) -> Vec {
    let s = wall[w];
    let arm = horizontal(point) - horizontal(s.point);
    return s.velocity + from_horizontal(s.spin * Real2(-arm.y, arm.x));
}
