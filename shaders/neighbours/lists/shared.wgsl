// twin: src/neighbours/lists.rs
// Lists slot: some grains are large, and the thousands of entries of one would hold up the invocations beside the one
// that walks them. So the first workgroups serve a large grain each: in every round their lanes have an entry each, and
// one adds up what these bring, in the order of the list, whatever lies between the contacts. In the other workgroups
// every invocation walks a list alone, in one round.

fn walk_of(workgroup: vec3<u32>, workgroups: vec3<u32>, lane: u32) -> Walk {
    let group = number_of(workgroup, workgroups);
    let others = params.bodies - params.large;
    let shared_list = group < params.large;
    let i = select((group - params.large) * WG + lane, others + group, shared_list);
    if (!shared_list && i >= others) {
        return Walk(group, lane, 0u, 0u, 0u, false);
    }
    let list = list_of(i);
    return Walk(group, lane, i, list.begin, list.end, !shared_list || lane == 0u);
}

/// Workgroups that walk the lists of all bodies.
fn groups_of_lists() -> u32 {
    return params.large + (params.bodies - params.large + WG - 1u) / WG;
}

/// Whether j is a body that a workgroup serves.
fn is_large(j: u32) -> bool {
    return j >= params.bodies - params.large && j < params.bodies;
}

var<workgroup> rounds_of_group: u32;

/// Rounds in which a workgroup walks its lists, at least one.
fn rounds_of(walk: Walk) -> u32 {
    if (walk.lane == 0u) {
        rounds_of_group = select(1u, (walk.end - walk.begin + WG - 1u) / WG, walk.group < params.large);
    }
    return workgroupUniformLoad(&rounds_of_group);
}

/// First entry, and one past the last, that the invocation has in a round.
fn entries_of(walk: Walk, round: u32) -> vec2<u32> {
    if (walk.group >= params.large) {
        return vec2<u32>(walk.begin, walk.end);
    }
    let entry = walk.begin + round * WG + walk.lane;
    return vec2<u32>(entry, min(entry + 1u, walk.end));
}

/// The sum over the list after a round that has brought this.
fn added_up(walk: Walk, total: ListSums, round: ListSums) -> ListSums {
    bring(walk.lane, round);
    workgroupBarrier();
    var sum = round;
    if (walk.group < params.large) {
        sum = total;
        for (var lane = 0u; lane < WG && walk.lane == 0u; lane++) {
            sum = together(sum, brought(lane));
        }
    }
    workgroupBarrier();
    return sum;
}
