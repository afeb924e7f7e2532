// twin: src/contact/normal.rs
// Normal slot: Hertz' contact of elastic spheres (Johnson, Contact Mechanics, 1985, eq. 4.23). pair.stiffness is the
// effective modulus E*, Pa: 1/E* = (1 - nu_i²)/E_i + (1 - nu_j²)/E_j.

/// What the energy is over force and overlap, 2/5, times its power of the effective radius, 1/2.
const ENERGY_OF_RADIUS: Real = 0.2;

/// Pressing force, N, of an overlap: 4/3 E* √(R* δ) δ.
fn normal_force(pair: Pair, c: ContactState) -> Real {
    return -Real(4) / 3 * pair.stiffness * contact_radius(c) * c.gap;
}

/// Its slope, N/m: 2 E* √(R* δ).
fn normal_stiffness(pair: Pair, c: ContactState) -> Real {
    return 2 * pair.stiffness * contact_radius(c);
}

/// Energy stored in the overlap, J: 8/15 E* √(R* δ) δ².
fn normal_energy(pair: Pair, c: ContactState) -> Real {
    return Real(8) / 15 * pair.stiffness * contact_radius(c) * c.gap * c.gap;
}

/// Radius of the contact area, m: √(R* δ).
fn contact_radius(c: ContactState) -> Real {
    return sqrt(c.radius * max(-c.gap, Real(0)));
}

/// By what part the stiffness has fallen in this step: 1 - √(δ / δ before), at least 0. What is held by it falls as much,
/// so that no cycle of loading gains energy (Thornton, Cummins & Cleary 2013, Powder Technol. 233, 30).
fn softening(c: ContactState) -> Real {
    let before = c.opening - c.gap;
    if (c.opening > 0 && before > 0) {
        return min(c.opening, before) / (before + sqrt(before * max(-c.gap, Real(0))));
    }
    return 0;
}

/// The larger stiffness of this step and the one before over the smaller, less one: what springs that hold what they
/// held, softened, lose of their energy now.
fn stiffness_change(c: ContactState) -> Real {
    let smaller = min(-c.gap, c.opening - c.gap);
    if (!(smaller > 0)) {
        return 0;
    }
    let larger = max(-c.gap, c.opening - c.gap);
    return max(c.opening, -c.opening) / smaller / (1 + sqrt(larger / smaller));
}
