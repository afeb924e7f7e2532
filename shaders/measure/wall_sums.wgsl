// twin: src/measure/wall_sums.rs
// What free grains do to walls at step n, in an order that no sorting changes: row p of every wall adds up the grains with
// the numbers p, p + rows, p + 2 rows, … Few grains are at a wall, so the next one that is is looked for first, and then
// its contact is computed: lanes that go in step compute no more contacts than the lane that has most of them.

/// Row p of all walls, or of driven ones alone.
fn add_up_row(p: u32, all: bool) {
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
        let w = (tagged & INDEX) - params.bodies;
        if (all || wall[w].driven != 0u) {
            add_load(p * params.walls + w, i, list.end, tagged);
        }
    }
}

/// Of the contact of body i in this entry of its list.
fn add_load(row: u32, i: u32, entry: u32, tagged: u32) {
    let here = body(i);
    let contact = contact_of(i, here, entry, tagged);
    if (!contact.is_active || here.velocity.inverse_mass == 0) {
        return;
    }
    let arm = (here.position.x - wall[(tagged & INDEX) - params.bodies].point) + contact.arm;
    wall_load_sums[row].force -= contact.force;
    wall_load_sums[row].moment -= moment(arm, contact.force) + contact.couple;
    let n = contact.arm / sqrt(dot(contact.arm, contact.arm));
    wall_load_sums[row].normal_force -= dot(contact.force, n);
    // Rigid grains store nothing, and have no stiffness.
    if (contact.gap < 0 && contact.energy > 0) {
        let held = max(dot(contact.damping - contact.force, n), Real(0));
        wall_load_sums[row].stiffness += STEEPEST * held / -contact.gap;
    }
}
