// twin: src/contact/rolling.rs
// Rolling slot: grains roll freely. No couple, no history.

struct RollingHistory {
    torque: Spin,
}

struct Rolling {
    couple: Spin,
    damping: Spin,
    history: RollingHistory,
    dashpot: Real,
    plastic: Real,
}

fn rolling_history(entry: u32, tagged: u32) -> RollingHistory {
    return RollingHistory();
}

fn set_rolling_history(entry: u32, h: RollingHistory) {}

fn opposite_rolling(h: RollingHistory, back: bool) -> RollingHistory {
    return h;
}

fn store_rolling(at: u32, entry: u32) {}

fn restore_rolling(entry: u32, at: u32, same: bool) {}

fn rolling_contact(c: ContactState, stiffness: Real, normal_force: Real, old: RollingHistory) -> Rolling {
    return Rolling();
}

/// The moment of a contact's force and its couple, N m.
fn with_couple(torque: Spin, couple: Spin) -> Spin {
    return torque;
}

fn rolling_energy(c: ContactState, stiffness: Real, h: RollingHistory) -> Real {
    return 0;
}
