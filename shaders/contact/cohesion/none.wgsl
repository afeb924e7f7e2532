// twin: src/contact/cohesion.rs
// Cohesion slot: surfaces do not attract each other. A law's parameters are its own, a table by pair of materials.

/// Whether a contact of this pair of materials acts: it does while the surfaces overlap. A law that acts beyond that
/// says so here, and how far in its twin (`reach`), so that lists go as far.
fn is_active(materials: u32, gap: Real, was_active: bool) -> bool {
    return gap < 0;
}

/// Whether surfaces that act on each other overlap. Those that do not only attract. Here all do.
fn overlaps(gap: Real) -> bool {
    return true;
}

/// Attraction, N, >= 0.
fn cohesive_force(c: ContactState) -> Real {
    return 0;
}

/// Its energy, J, <= 0, and 0 where it ends.
fn cohesive_energy(c: ContactState) -> Real {
    return 0;
}
