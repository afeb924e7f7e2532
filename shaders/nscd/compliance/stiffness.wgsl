// twin: src/nscd/compliance.rs
// Compliance slot: contacts give way as the springs and dashpots of the discrete element method do, taken implicitly. A
// contact solves u = (W + C) r + q in place of u = W r + q. It remembers its impulse, and its tangential spring.
var<storage, read_write> tangential_force: array<Packed>;         // entries, N: of the spring, on the grain of interest
var<storage, read_write> tangential_force_next: array<Packed>;    // entries, N: at the end of the step
var<storage, read_write> history_tangential_force: array<Packed>; // contacts, N

/// C, 1/kg, of a contact that has this of W. The pressing force of a spring and dashpot at the end of the step is
/// F = k (Δt u - g) + c u of the approach u and the gap g, so that u = F Δt / (Δt (k Δt + c)) + k g / (k Δt + c).
fn compliance_of(pair: Pair, inverse_mass: InverseEffectiveMass) -> UpdateScales {
    let normal = params.dt * (pair.stiffness * params.dt + dashpot_of(pair, inverse_mass));
    // Without friction nothing acts across.
    let across = 1 / (params.dt * params.dt * pair.tangential_stiffness);
    return UpdateScales(1 / normal, select(Real(0), across, pair.friction > 0));
}

/// Coefficient of the normal dashpot, N s/m.
fn dashpot_of(pair: Pair, inverse_mass: InverseEffectiveMass) -> Real {
    return damping_force(pair, Real(1), inverse_mass.normal, pair.stiffness);
}

/// The speed at which the force begins: which closes a gap within the step, or at which an overlap does not press.
fn bias_velocity_of(gap: Real, pair: Pair, inverse_mass: InverseEffectiveMass) -> Real {
    let yielding = pair.stiffness * params.dt;
    return gap / params.dt * select(yielding / (yielding + dashpot_of(pair, inverse_mass)), Real(1), gap > 0);
}

/// What the tangential spring adds to q, m/s: it has been stretched by the steps before.
fn spring_velocity(entry: u32, tagged: u32, n: Vec, compliance: UpdateScales) -> Vec {
    if ((tagged & ACTIVE) == 0u) {
        tangential_force[entry] = packed(Vec());
        return Vec();
    }
    return -(compliance.tangential * params.dt) * turned(unpacked(tangential_force[entry]), n);
}

/// A force of a spring turned into the contact plane, of the same size.
fn turned(force: Vec, n: Vec) -> Vec {
    let flat = force - dot(force, n) * n;
    let squared = dot(flat, flat);
    if (squared == 0) {
        return Vec();
    }
    return sqrt(dot(force, force) / squared) * flat;
}

/// A step ends with this impulse.
fn remember_spring(entry: u32, impulse: Vec) {
    let n = contact_geometry[entry].n;
    tangential_force_next[entry] = packed((1 / params.dt) * (impulse - dot(impulse, n) * n));
}

/// A contact with C in its scales and C r in its velocity, at this impulse on its first side.
fn compliant(side: OrientedContact, compliance: UpdateScales, impulse: Vec) -> OrientedContact {
    var yielding = side;
    let pressed = dot(impulse, side.n) * side.n;
    let across = impulse - pressed;
    // Its rounding along n, too, or it would be as that of C, which may be far less along n than across.
    let flat = across - dot(across, side.n) * side.n;
    yielding.normal += compliance.normal;
    yielding.tangential += compliance.tangential;
    yielding.velocity += compliance.normal * pressed + compliance.tangential * flat;
    return yielding;
}

/// C times the change of an impulse, and that again, J.
fn compliant_work(n: Vec, compliance: UpdateScales, change: Vec) -> Real {
    let pressed = dot(change, n);
    let across = change - pressed * n;
    return compliance.normal * pressed * pressed + compliance.tangential * dot(across, across);
}

fn store_spring(at: u32, entry: u32) {
    history_tangential_force[at] = tangential_force[entry];
}

fn restore_spring(entry: u32, at: u32, same: bool) {
    let force = unpacked(history_tangential_force[at]);
    tangential_force[entry] = packed(select(-force, force, same));
}
