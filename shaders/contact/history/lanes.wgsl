// twin: src/contact/history.rs
// What contacts of the discrete element method remember: the lanes of the sub-models that remember something, together.

/// What a contact remembers, on the first of the two, or on the grain of interest.
struct History {
    tangential: TangentialHistory,
    rolling: RollingHistory,
}

/// What the contact at this entry remembers, on the grain of interest.
fn history_of(entry: u32, tagged: u32) -> History {
    return History(tangential_history(entry, tagged), rolling_history(entry, tagged));
}

fn set_history(entry: u32, h: History) {
    set_tangential_history(entry, h.tangential);
    set_rolling_history(entry, h.rolling);
}

/// As the other of the two sees it, if `back`.
fn opposite(h: History, back: bool) -> History {
    return History(opposite_tangential(h.tangential, back), opposite_rolling(h.rolling, back));
}

fn store_lanes(at: u32, entry: u32) {
    store_tangential(at, entry);
    store_rolling(at, entry);
}

fn restore_lanes(entry: u32, at: u32, same: bool) {
    restore_tangential(entry, at, same);
    restore_rolling(entry, at, same);
}
