// twin: src/contact/growth.rs
// Growth slot: the radii of materials grow or shrink, each at its own rate. Surfaces move away from their centres, and
// contacts see that as they see any other approach. Owns what is known of growth at this step; `dem/grow` moves it on.
var<storage, read> growth_rate: array<Real>;            // materials, 1/s: what radii have grown by in the step before, over themselves
var<storage, read_write> growth_rate_next: array<Real>; // materials

/// A grain at time 0.
struct StartSize {
    radius: Real,       // m: in single precision 12 bits of it
    radius_low: Real,   // m: what it has beyond
    inverse_mass: Real, // 1/kg; 0 for a fixed grain
}

/// What grains of a material have become after a step, over what they were at time 0.
struct GrowthStep {
    factor: Real,         // of radii: in single precision 12 bits of it
    factor_low: Real,     // what it has beyond
    inverse_volume: Real, // of inverse masses
    rate: Real,           // 1/s: what radii have grown by in this step, over themselves
}

/// How fast the surface of body i with this radius, or of a wall, moves away from its centre, m/s.
fn surface_growth(i: u32, radius: Real) -> Real {
    return growth_rate[material_of(i)] * radius;
}

/// The velocity of the surfaces of i and j past each other, if that of their centres is v; a wall has no radius.
fn past_growth(v: Vec, n: Vec, i: u32, radius: Real, j: u32, radius_to: Real) -> Vec {
    return v + (surface_growth(i, radius) + surface_growth(j, radius_to)) * n;
}

/// Work of growth on what a contact of body i with j holds, per time, W: that of its pressing force on surfaces that move,
/// and of energy that grows with the effective radius.
fn growth_power(i: u32, here: Body, j: u32, contact: Contact) -> Real {
    let a = here.position.radius;
    let rate = growth_rate[material_of(i)];
    var speed = rate * a;
    var bending = rate; // of the effective radius, over it, 1/s
    if (j < params.bodies) {
        let b = position[j].radius;
        let rate_to = growth_rate[material_of(j)];
        speed += rate_to * b;
        bending = (rate * b + rate_to * a) / (a + b);
    }
    let pressing = -dot(contact.force, contact.arm) / (a + 0.5 * contact.gap);
    return pressing * (speed - ENERGY_OF_RADIUS * contact.gap * bending);
}

/// The same on the energies of body i, W: mass comes with the velocity, the spin and the place of the body.
fn growth_power_of_mass(i: u32, own: Energies) -> Real {
    let translation = 0.5 * dot(own.flux, Vec(1));
    let spin = own.kinetic - translation;
    let dims = Real(DIMENSIONS);
    return growth_rate[material_of(i)] * (dims * (translation + own.potential) + (dims + 2) * spin);
}
