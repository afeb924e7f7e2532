// twin: src/contact/growth.rs
// Growth slot: radii stay as they are.

/// The velocity of the surfaces of i and j past each other, if that of their centres is v.
fn past_growth(v: Vec, n: Vec, i: u32, radius: Real, j: u32, radius_to: Real) -> Vec {
    return v;
}

/// Work of growth on what a contact of body i with j holds, per time.
fn growth_power(i: u32, here: Body, j: u32, contact: Contact) -> Real {
    return 0;
}

/// The same on the energies of body i.
fn growth_power_of_mass(i: u32, own: Energies) -> Real {
    return 0;
}
