// twin: src/contact/tangential.rs
// Tangential slot: smooth grains. No force, no history.

struct TangentialHistory {
    force: Vec,
}

struct Tangential {
    force: Vec,
    history: TangentialHistory,
    dissipation: Real,
}

fn tangential_history(entry: u32, tagged: u32) -> TangentialHistory {
    return TangentialHistory();
}

fn set_tangential_history(entry: u32, h: TangentialHistory) {}

fn opposite_tangential(h: TangentialHistory, back: bool) -> TangentialHistory {
    return h;
}

fn store_tangential(at: u32, entry: u32) {}

fn restore_tangential(entry: u32, at: u32, same: bool) {}

fn tangential_contact(pair: Pair, c: ContactState, normal_force: Real, old: TangentialHistory) -> Tangential {
    return Tangential();
}

fn tangential_energy(pair: Pair, c: ContactState, h: TangentialHistory) -> Real {
    return 0;
}
