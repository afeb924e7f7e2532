// twin: src/laws/contact.rs
// The grains, in the order of the cells at the last rebuild. What a kernel changes it writes to an array of the same
// name and `_next`; the plan then exchanges the two.
var<storage, read> place: array<Place>;   // N, at step n
var<storage, read> motion: array<Motion>; // N, at n - 1/2
var<storage, read> number: array<u32>;    // N: the grain's number in the scene
var<storage, read_write> place_next: array<Place>;   // N
var<storage, read_write> motion_next: array<Motion>; // N
var<storage, read_write> travel: array<Real>;        // N, m: way since the lists were made

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

/// Grain i has come to this point by a way of this length, m. Whether the lists may miss a neighbour of it from now on, or the
/// grain is lost: beyond the domain, or too fast to be followed.
fn arrive(i: u32, place: Place, residue: Residue, point: Point, stride: Real, crossed: bool) -> bool {
    place_next[i] = Place(point.x, place.radius);
    keep_residue(i, Residue(point.residue, residue.radius));
    let way = travel[i] + stride;
    travel[i] = way;
    let lost = crossed || outside(point.x, params.lower, params.upper) || !(stride <= params.step_limit);
    if (lost) {
        atomicMax(&counters.bad_body, params.bodies - number[i]);
    }
    return lost || !(way <= params.drift_limit);
}
