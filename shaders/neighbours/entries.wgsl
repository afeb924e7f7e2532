// twin: src/neighbours/entries.rs
// Who walks a list, and its end, behind its grains.

/// A list, as an invocation of a workgroup walks it.
struct Walk {
    group: u32,    // number of the workgroup
    lane: u32,
    body: u32,     // whose list it is
    begin: u32,    // first entry
    end: u32,      // one past the last; none where there are more invocations than bodies
    answers: bool, // whether this invocation gets the sum over the list
}

/// Put the walls near grain i on its list, from this entry on, and NONE on what is left of it; one past the last wall.
fn list_walls(i: u32, first: u32, end: u32) -> u32 {
    let here = position[i];
    let fixed = velocity[i].inverse_mass == 0;
    var filled = first;
    for (var w = 0u; w < params.walls && !fixed; w++) {
        if (wall_separation(w, here, position_low_of(i)).gap < params.margin) {
            if (filled == end) {
                atomicAdd(&counters.unlisted, 1u); // cannot happen, see `count_neighbours`
                continue;
            }
            neighbour[filled] = params.bodies + w;
            filled++;
        }
    }
    for (var entry = filled; entry < end; entry++) {
        neighbour[entry] = NONE;
    }
    return filled;
}
