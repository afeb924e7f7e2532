// twin: src/nscd/coloring/priority.rs
// Coloured Gauss-Seidel: contacts of one colour share no grain, so that all of them may be updated in place at once.
// Colors are given out on the device and last as long as the lists; contacts that come to take part later get theirs
// then. Passes work on copies of the contacts in the order of the colours, because those of a colour lie far apart in
// the lists.

/// The colour of a contact, from 1; 0: none yet. Its place among those of the colour counts at the entry of the smaller
/// index.
struct ContactColor {
    color: u32,
    rank: u32,
}

/// A contact in the order of the colours.
struct ColoredContact {
    first: u32,  // the body with the smaller index; NONE: takes no part in this step
    second: u32, // the other, or bodies + w for wall w
    entry: u32,   // in the list of the first
    back: u32,   // in the list of the second; NONE for a wall
}

var<storage, read_write> contact_color: array<ContactColor>; // entries
// Of contacts colour by colour, from the first grain; impulses, N s, are those on it. A pass writes those of the pass
// before anew.
var<storage, read_write> colored_contact: array<ColoredContact>;
var<storage, read_write> colored_geometry: array<ContactGeometry>;
var<storage, read_write> colored_free_velocity: array<Packed>;
var<storage, read_write> colored_inverse_effective_mass: array<InverseEffectiveMass>;
var<storage, read_write> colored_impulse: array<Packed>;
var<storage, read_write> colored_impulse_before: array<Packed>;

/// How far the colouring is.
struct ColoringState {
    uncolored: atomic<u32>, // 1: proposals wait to be answered
    colors: atomic<u32>,    // the last colour in use
    contacts: atomic<u32>,   // that have a colour
}

/// Contacts of a grain that have no colour, by what the grain meets there.
struct LargeContacts {
    small: atomic<u32>,
    heavy: atomic<u32>, // see `is_heavy`
}

/// How far a pass is.
struct ColorCursor {
    colors: u32,  // that are done
    contacts: u32, // of these colours
}

/// Whether j is heavy beside small grains: a large one, a fixed one or a wall.
fn is_heavy(j: u32) -> bool {
    if (j >= params.bodies) {
        return true;
    }
    return is_large(j) || velocity[j].inverse_mass == 0;
}

/// A rank of contacts on which two grains agree, and that neighbours in space do not share: so that many contacts are
/// the first of both of their grains. a and b are numbers of bodies, or bodies + w for wall w.
fn priority(a: u32, b: u32) -> u32 {
    var bits = (min(a, b) + 1u) * 2654435769u + (max(a, b) + 1u) * 2246822519u;
    bits = (bits ^ (bits >> 15u)) * 2246822519u;
    bits = (bits ^ (bits >> 13u)) * 3266489917u;
    return bits ^ (bits >> 16u);
}
