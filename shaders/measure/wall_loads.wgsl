// twin: src/measure/wall_loads.rs
// What free grains do to walls at step n, in an order that no sorting changes: row p of every wall adds up the grains with
// the numbers p, p + rows, p + 2 rows, … Few grains are at a wall, so the next one that is is looked for first, and then
// its contact is computed: lanes that go in step compute no more contacts than the lane that has most of them.
@compute @workgroup_size(WG)
fn wall_loads(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(gid, groups);
    if (p >= params.partial_sums_len) {
        return;
    }
    for (var w = 0u; w < params.walls; w++) {
        wall_load_sums[p * params.walls + w] = WallLoad();
    }
    var number = p;
    var i = 0u;
    var list = List();
    loop {
        // Walls come last, behind them what a slice leaves empty.
        var tagged = NONE;
        while (tagged == NONE && (list.end > list.begin || number < params.bodies)) {
            if (list.end == list.begin) {
                i = index_of_id[number];
                list = list_of(i);
                number += params.partial_sums_len;
                continue;
            }
            list.end -= list.step;
            tagged = neighbour[list.end];
            if (tagged != NONE && (tagged & INDEX) < params.bodies) {
                list.end = list.begin;
                tagged = NONE;
            }
        }
        if (tagged == NONE) {
            break;
        }
        let here = body(i);
        let contact = contact_of(i, here, list.end, tagged);
        if (contact.is_active && here.velocity.inverse_mass > 0) {
            let w = (tagged & INDEX) - params.bodies;
            let arm = (here.position.x - wall[w].point) + contact.arm;
            wall_load_sums[p * params.walls + w].force -= contact.force;
            wall_load_sums[p * params.walls + w].moment -= moment(arm, contact.force) + contact.couple;
        }
    }
}
