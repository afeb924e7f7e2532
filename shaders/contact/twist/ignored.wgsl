// twin: src/contact/twist.rs
// Twist slot: springs do not follow the twist of their contact about its normal; (2.11) as printed.

/// By how much a contact has turned about its normal in this step, from the sum of the two spins.
fn twist_of(n: Vec, spins: Spin) -> Real {
    return 0;
}

/// What a spring of a step ago changes by, N, where it turns into the contact plane of now.
fn turning(old: Vec, c: ContactState) -> Vec {
    return transport(old, c.n, c.n_before);
}

/// The same of a moment, N m.
fn turning_spin(old: Spin, c: ContactState) -> Spin {
    return transport_spin(old, c.n, c.n_before);
}
