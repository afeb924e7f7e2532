// twin: src/space/turning.rs
// Turning slot: a wall turns, a cylinder spins about its axis, or its radius changes.

/// The contact normal when the grain was at x_before, a step ago, for the rotation Z of the spring.
fn wall_normal_before(w: u32, x_before: Vec) -> Vec {
    let s = wall[w];
    if (s.radius == 0) {
        if (spin_squared(s.spin) == 0) {
            return -s.normal;
        }
        let before = s.normal - params.history_dt * spin_velocity(s.spin, s.normal);
        return -before / sqrt(dot(before, before));
    }
    return outward(horizontal(x_before + params.history_dt * s.velocity - s.point));
}

/// Velocity of the wall's material at a point of its surface, m/s.
fn wall_velocity(w: u32, point: Vec) -> Vec {
    let s = wall[w];
    let v = s.velocity + spin_velocity(s.spin, point - s.point);
    if (s.growth == 0) {
        return v;
    }
    return v + s.growth * outward(horizontal(point - s.point));
}

/// The spin of a grain relative to the wall, rad/s.
fn relative_to_wall(spin: Spin, w: u32) -> Spin {
    return spin - wall[w].spin;
}
