// twin: src/neighbours/entries.rs
// The end of a list, behind its grains.

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
