// twin: src/nscd/member_impulses.rs
// Contact dynamics of clumps 8: members hand over the impulses that the step ends with.
/// The impulses that the step ends with; what carries one is a contact of the next step.
fn impulses_of(i: u32, entries: vec2<u32>) -> ListSums {
    var total = ListSums();
    for (var entry = entries.x; entry < entries.y; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let impulse = impulse_of(entry);
        let pressed = any(impulse != Vec());
        set_active(entry, tagged, pressed);
        remember_spring(entry, impulse);
        if (pressed) {
            total.impulse = with_impulse(total.impulse, entry, impulse);
        }
    }
    return total;
}

@compute @workgroup_size(GROUP)
fn member_impulses(
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
    // A step without grains is one, too.
    if (number_of(workgroup, workgroups) == 0u && lane == 0u) {
        atomicAdd(&counters.steps_done, 1u);
    }
    if (walk.answers) {
        store_member_load(walk.body, total.impulse);
    }
}
