// twin: src/contact/materials.rs
// Materials slot: one material; its parameters are a number of Params.
fn pair_of(i: u32, j: u32) -> Pair {
    return params.pair;
}

/// The material of grain i, or of a wall.
fn material_of(i: u32) -> u32 {
    return 0u;
}

fn pair_index(i: u32, j: u32) -> u32 {
    return 0u;
}
