// twin: src/contact/contacts.rs
// The contacts of a body, by whatever law its method has.

struct Contact {
    gap: Real,        // m
    closed: bool,     // if not, nothing below means anything
    force: Vec,       // N, on the grain of interest
    arm: Vec,         // m, from its centre to the contact point
    spring: Vec,      // N, the tangential part of the force
    damping: Vec,     // N, what the dashpot adds to the force
    dissipation: Real // W, of dashpot and sliding
}

/// All contacts of grain i, in ascending order of the other's id. The springs stay as they are.
fn contacts_of(i: u32, here: Body) -> ForceTorque {
    var sum = ForceTorque();
    let end = list_start[i + 1u];
    for (var entry = list_start[i]; entry < end; entry++) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let contact = contact_of(i, here, entry, tagged);
        if (contact.closed) {
            sum.force += contact.force;
            sum.torque += moment(contact.arm, contact.force);
        }
    }
    return sum;
}

