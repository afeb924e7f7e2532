// twin: src/neighbours/entries.rs
// Where lists lie, who walks one, and its end, behind its grains.

/// Where a list lies: every step-th entry from the first on. Lists lie in slices ("sliced ELLPACK"): those of so many
/// grains side by side, entry k of one beside entry k of the next, so that lanes that walk them in step touch few cache
/// lines. In a slice they are as long as the longest; what a grain does not need is NONE. Large grains, whose lists
/// workgroups walk, have a slice each.
struct List {
    begin: u32,
    end: u32,  // one step past the last
    step: u32,
}

fn list_of(i: u32) -> List {
    let slice = slice_of(i);
    let step = select(1u, lists_abreast(), i < params.bodies - params.large);
    let lane = i & (step - 1u);
    return List(list_start[slice] + lane, list_start[slice + 1u] + lane, step);
}

/// Lists side by side in a slice: the step of those of all grains but the large ones.
fn lists_abreast() -> u32 {
    return 1u << params.slice_shift;
}

/// The slice that grain i is in.
fn slice_of(i: u32) -> u32 {
    let others = params.bodies - params.large;
    let large_ones = (others + lists_abreast() - 1u) >> params.slice_shift;
    return select(large_ones + (i - others), i >> params.slice_shift, i < others);
}

/// Entries of all slices.
fn all_entries() -> u32 {
    return list_start[slice_of(params.bodies)];
}

/// The sum of two counts, or the largest number, where that would be too small: so what is too much is seen.
fn counted(a: u32, b: u32) -> u32 {
    return select(a + b, NONE, a + b < a);
}

/// A list, as an invocation of a workgroup walks it.
struct Walk {
    group: u32,    // number of the workgroup
    lane: u32,
    body: u32,     // whose list it is
    begin: u32,    // first entry
    end: u32,      // past the last; none where there are more invocations than bodies
    answers: bool, // whether this invocation gets the sum over the list
}

/// Put the walls near grain i on its list, from this entry on, and NONE on what is left of it; one past the last wall.
fn list_walls(i: u32, list: List, first: u32) -> u32 {
    let here = position[i];
    let fixed = velocity[i].inverse_mass == 0;
    var filled = first;
    for (var w = 0u; w < params.walls && !fixed; w++) {
        if (wall_separation(w, here, position_low_of(i)).gap < params.margin) {
            if (filled >= list.end) {
                atomicAdd(&counters.unlisted, 1u); // cannot happen, see `count_neighbours`
                continue;
            }
            neighbour[filled] = params.bodies + w;
            filled += list.step;
        }
    }
    for (var entry = filled; entry < list.end; entry += list.step) {
        neighbour[entry] = NONE;
    }
    return filled;
}
