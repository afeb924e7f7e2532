// twin: src/contact/cohesion.rs
// Cohesion slot: surfaces do not attract each other.

/// Whether a contact acts: it does while the surfaces overlap. A law that holds surfaces together beyond that says so here, and says how
/// far in its twin (`reach`), so that lists go as far.
fn is_active(gap: Real, was_active: bool) -> bool {
    return gap < 0;
}

/// Attraction, N, >= 0.
fn cohesive_force(pair: Pair, c: ContactState) -> Real {
    return 0;
}
