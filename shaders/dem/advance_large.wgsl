// twin: src/dem/advance_large.rs
// What `advance` does, for the large grains, by a workgroup for each: thousands of contacts would hold up the invocations
// beside the one that computes them alone. Lanes compute a contact each, and one adds them up in the order of the list.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

const LANES = 64u;

/// What a contact adds.
struct Share {
    is_active: bool,
    crossed: bool, // the grain's centre is beyond a wall
    deep: bool,
    sum: ForceTorque,
}

var<workgroup> shares: array<Share, LANES>;
var<workgroup> own_row: vec2<u32>; // first entry and one past the last; none in a step that is halted

/// The contact at an entry, whose history is kept.
fn share_of(i: u32, here: Body, entry: u32) -> Share {
    let tagged = neighbour[entry];
    if (tagged == NONE) {
        return Share();
    }
    let contact = contact_of(i, here, entry, tagged);
    set_active(entry, tagged, contact.is_active);
    if (!contact.is_active) {
        return Share();
    }
    set_history(entry, contact.history);
    let crossed = (tagged & INDEX) >= params.bodies && is_crossed(contact.gap, here.position.radius);
    return Share(true, crossed, contact.is_deep, ForceTorque(contact.force, contact_torque(contact)));
}

@compute @workgroup_size(LANES)
fn advance_large(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let place = number_of(group, groups);
    let i = params.bodies - params.large + min(place, params.large - 1u);
    let moves = place < params.large && halt < HALTED;
    if (lane == 0u) {
        let list = list_of(i);
        own_row = select(vec2<u32>(0u), vec2<u32>(list.begin, list.end), moves);
    }
    let row = workgroupUniformLoad(&own_row);
    set_seed(params.step + halt);
    let here = body(i);
    var forces = BodyForces();
    for (var first = row.x; first < row.y; first += LANES) {
        shares[lane] = Share();
        if (first + lane < row.y) {
            shares[lane] = share_of(i, here, first + lane);
        }
        workgroupBarrier();
        for (var l = 0u; l < LANES && lane == 0u; l++) {
            let share = shares[l];
            if (share.is_active) {
                forces.sum.force += share.sum.force;
                forces.sum.torque += share.sum.torque;
                forces.crossed |= share.crossed;
                forces.deep |= share.deep;
            }
        }
        workgroupBarrier();
    }
    if (lane == 0u && moves) {
        let deep = report_deep(forces.deep);
        if (leap(i, here, forces) || deep) {
            atomicMax(&halt_next, HALTED);
        }
    }
}
