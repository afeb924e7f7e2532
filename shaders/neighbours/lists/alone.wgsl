// twin: src/neighbours/lists.rs
// Lists slot: no grain is large, and every invocation walks a list alone.

fn walk_of(workgroup: vec3<u32>, workgroups: vec3<u32>, lane: u32) -> Walk {
    let group = number_of(workgroup, workgroups);
    let i = group * WG + lane;
    if (i >= params.bodies) {
        return Walk(group, lane, 0u, 0u, 0u, false);
    }
    let list = list_of(i);
    return Walk(group, lane, i, list.begin, list.end, true);
}

/// Workgroups that walk the lists of all bodies.
fn groups_of_lists() -> u32 {
    return (params.bodies + WG - 1u) / WG;
}

/// Whether j is a body that a workgroup serves.
fn is_large(j: u32) -> bool {
    return false;
}

/// Rounds in which a workgroup walks its lists, at least one: kernels ask after a round, so that a single one is no loop.
fn rounds_of(walk: Walk) -> u32 {
    return 1u;
}

/// First entry, and one past the last, that the invocation has in a round.
fn entries_of(walk: Walk, round: u32) -> vec2<u32> {
    return vec2<u32>(walk.begin, walk.end);
}

/// The sum over the list after a round that has brought this.
fn added_up(walk: Walk, total: ListSums, round: ListSums) -> ListSums {
    return round;
}
