// twin: src/space/walls.rs
// Walls slot: no walls; the null object of walls/some.wgsl.
fn wall_separation(w: u32, here: Position, low: PositionLow) -> Separation {
    return Separation(Real(1), first_axis());
}

fn is_crossed(gap: Real, radius: Real) -> bool {
    return false;
}

fn wall_normal_before(w: u32, x_before: Vec) -> Vec {
    return first_axis();
}

fn wall_velocity(w: u32, point: Vec) -> Vec {
    return Vec();
}

fn relative_to_wall(spin: Spin, w: u32) -> Spin {
    return spin;
}
