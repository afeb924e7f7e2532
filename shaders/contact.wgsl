// twin: src/laws/contact.rs
// One contact, seen from one of its two sides. What acts in it is the method's.

struct Contact {
    gap: Real,        // m
    closed: bool,     // if not, nothing below means anything
    force: Vec,       // N, on the grain of interest
    arm: Vec,         // m, from its centre to the contact point
    spring: Vec,      // N, the tangential part of the force
    damping: Vec,     // N, what the dashpot adds to the force
    dissipation: Real // W, of dashpot and sliding
}

/// Force and moment of all contacts of a grain.
struct Gathered {
    force: Vec,
    torque: Spin,
}

/// What a grain has by itself at step n.
struct Energies {
    kinetic: Real,     // J
    potential: Real,   // J
    net_force: Real,   // N
    dissipation: Real, // W, of global damping, and what dashpots take less because velocities have changed since the half step
}

/// All contacts of grain i, in ascending order of the other's id. The springs stay as they are.
fn contacts_of(i: u32, here: Body) -> Gathered {
    var sum = Gathered();
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let contact = contact_of(i, here, slot, entry);
        if (contact.closed) {
            sum.force += contact.force;
            sum.torque += moment(contact.arm, contact.force);
        }
    }
    return sum;
}

var<storage, read_write> part: array<Part>;      // parts: rows of the measurement

struct Part {
    kinetic: Real,       // J, velocities brought to step n
    potential: Real,     // J
    elastic: Real,       // J, normal and tangential springs
    net_force: Real,     // N, sum of |total force| over free grains
    contact_force: Real, // N, sum of |spring force| over contacts
    dissipation: Real,   // W, of dashpots, sliding, contacts that open and global damping
    overlap: Real,       // largest overlap over the smaller radius
    sides: u32,          // contacts of free grains; one between two free grains is seen twice
    single_sides: u32,   // those of them with a wall or a fixed grain
}
