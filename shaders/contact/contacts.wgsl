// twin: src/contact/contacts.rs
// The contacts of a body, by whatever law its method has.

/// A contact, seen from the grain of interest.
struct Contact {
    gap: Real,         // m
    is_active: bool,   // if not, nothing below means anything
    is_deep: bool,     // the surfaces overlap by more than `deep_overlap`
    force: Vec,        // N, on the grain of interest
    arm: Vec,          // m, from its centre to the contact point
    couple: Spin,      // N m, of rolling resistance
    damping: Vec,      // N, the part of the force that is the normal dashpot's
    couple_damping: Spin, // N m, the part of the couple that is the rolling dashpot's
    dashpot: Real,     // W, dissipation of dashpots
    sliding: Real,     // W, that of sliding and plastic rolling since a step ago
    energy: Real,      // J, stored
    history: History,
}

/// All contacts of grain i, in ascending order of the other's id. What contacts remember stays as it is.
fn contacts_of(i: u32, here: Body) -> ForceTorque {
    var sum = ForceTorque();
    let list = list_of(i);
    for (var entry = list.begin; entry < list.end; entry += list.step) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let contact = contact_of(i, here, entry, tagged);
        if (contact.is_active) {
            sum.force += contact.force;
            sum.torque += contact_torque(contact);
        }
    }
    return sum;
}

