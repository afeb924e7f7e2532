// twin: src/nscd/gather_impulses.rs
// Contact dynamics 5: velocities freed of the rounding that passes have left in them, and loads; members of clumps hold what
// `refresh_members` needs for that.

/// The impulses on a body.
fn impulses_of(i: u32, entries: vec2<u32>) -> ListSums {
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        if ((tagged & ACTIVE) != 0u) {
            let mine = impulse_of(entry);
            total.impulse = with_impulse(total.impulse, entry, mine);
            total.load += sqrt(dot(mine, mine));
        }
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn gather_impulses(
    @builtin(workgroup_id) workgroup: vec3<u32>,
    @builtin(num_workgroups) workgroups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let walk = walk_of(workgroup, workgroups, lane);
    let rounds = rounds_of(walk);
    var total = ListSums();
    var round = 0u;
    loop {
        total = added_up(walk, total, impulses_of(walk.body, entries_of(walk, round)));
        continuing {
            round++;
            break if round >= rounds;
        }
    }
    if (walk.answers) {
        respond_to_gather(walk.body, total.impulse, total.load);
    }
}
