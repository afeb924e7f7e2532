// twin: src/body/grains.rs
// Grains slot: every body is a grain, a sphere or disk.

/// Whether bodies i and j belong to one grain.
fn same_grain(i: u32, j: u32) -> bool {
    return i == j;
}

/// What single precision leaves out of its velocities goes along when body `old` becomes body i.
fn permute_velocity_low(i: u32, old: u32) {
    store_velocity_low(i, velocity_low_of(old));
}

/// How many bodies the grain of body i has.
fn member_count(i: u32) -> u32 {
    return 1;
}

/// One of them.
fn member_of(i: u32, m: u32) -> u32 {
    return i;
}

/// From the centre of the grain of body i to the body: nothing.
fn arm_in_grain(i: u32) -> Vec {
    return Vec();
}
