// twin: src/laws/walls.rs
// Walls slot: no walls; the null object of walls/some.wgsl.
fn touch_wall(w: u32, here: Place, residue: Residue) -> Touch {
    return Touch(Real(1), first_axis());
}

fn wall_normal_before(w: u32, x_before: Vec) -> Vec {
    return first_axis();
}

fn wall_velocity(w: u32, point: Vec) -> Vec {
    return Vec();
}
