// twin: src/laws/contact.rs
// The grains, in the order of the cells at the last rebuild. What a kernel changes it writes to an array of the same
// name and `_next`; the plan then exchanges the two.
var<storage, read> place: array<Place>;   // N, at step n
var<storage, read> motion: array<Motion>; // N, at n - 1/2
var<storage, read> number: array<u32>;    // N: the grain's number in the scene

/// All there is to know of a grain.
struct Body {
    place: Place,
    residue: Residue,
    motion: Motion,
    spin: Spin,
}

fn body(i: u32) -> Body {
    return Body(place[i], residue_of(i), motion[i], spin_of(i));
}
