// twin: src/contact/twist.rs
// Twist slot: springs do not follow the twist of their contact about its normal; (2.11) as printed.

/// By how much a contact has turned about its normal in this step, from the sum of the two spins.
fn twist_of(n: Vec, spins: Spin) -> Real {
    return 0;
}

/// A spring of a step ago, N, in the contact plane of now.
fn carried(old: Vec, c: ContactState) -> Vec {
    return transported(old, c.n, c.n_before);
}

/// The same of a moment, N m.
fn carried_spin(old: Spin, c: ContactState) -> Spin {
    return transported_spin(old, c.n, c.n_before);
}
