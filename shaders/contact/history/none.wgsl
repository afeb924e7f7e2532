// twin: src/contact/history.rs
// History slot: contacts remember nothing.

fn set_active(entry: u32, tagged: u32, counts: bool) {}

fn active_contacts(i: u32) -> u32 {
    return 0u;
}

fn restore_history(entry: u32, i: u32, j: u32) -> u32 {
    return 0u;
}
