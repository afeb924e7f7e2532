// twin: src/contact/normal.rs
// Normal slot: linear spring (2.1).

/// Energy follows from force and overlap, whatever the radii are.
const ENERGY_OF_RADIUS: Real = 0;

/// Pressing force, N, of an overlap.
fn normal_force(pair: Pair, c: ContactState) -> Real {
    return -pair.stiffness * c.gap;
}

/// Its slope, N/m.
fn normal_stiffness(pair: Pair, c: ContactState) -> Real {
    return pair.stiffness;
}

/// Energy stored in the overlap, J.
fn normal_energy(pair: Pair, c: ContactState) -> Real {
    return 0.5 * pair.stiffness * c.gap * c.gap;
}

/// By what part the stiffness has fallen in this step: it stays.
fn softening(c: ContactState) -> Real {
    return 0;
}

/// The larger stiffness of this step and the one before over the smaller, less one.
fn stiffness_change(c: ContactState) -> Real {
    return 0;
}
