// twin: src/contact/tangential.rs
// Friction slot: smooth grains. No springs and no history.

fn spring_of(entry: u32, tagged: u32) -> Vec {
    return Vec();
}

fn kept_spring(entry: u32) -> Vec {
    return Vec();
}

fn keep_spring(entry: u32, f: Vec) {}

fn set_active(entry: u32, tagged: u32, closed: bool) {}

fn stretched_spring(old: Vec, pair: Pair, n: Vec, n_before: Vec, v_rel: Vec) -> Vec {
    return Vec();
}

fn slid_spring(stretched: Vec, pair: Pair, pressing: Real) -> Vec {
    return Vec();
}

fn sliding_power(old: Vec, stretched: Vec, slid: Vec, pair: Pair) -> Real {
    return 0;
}

fn spring_energy(f: Vec, pair: Pair) -> Real {
    return 0;
}

fn active_contacts(i: u32) -> u32 {
    return 0u;
}

fn restore_history(entry: u32, i: u32, j: u32) -> u32 {
    return 0u;
}
