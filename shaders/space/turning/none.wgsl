// twin: src/space/turning.rs
// Turning slot: all points of a wall move alike.

/// The contact normal when the grain was at x_before, a step ago, for the rotation Z of the spring.
fn wall_normal_before(w: u32, x_before: Vec) -> Vec {
    let s = wall[w];
    if (s.radius == 0) {
        return -s.normal;
    }
    return outward(horizontal(x_before + params.history_dt * s.velocity - s.point));
}

/// Velocity of the wall's material, m/s.
fn wall_velocity(w: u32, point: Vec) -> Vec {
    return wall[w].velocity;
}

/// The spin of a grain relative to the wall, rad/s.
fn relative_to_wall(spin: Spin, w: u32) -> Spin {
    return spin;
}
