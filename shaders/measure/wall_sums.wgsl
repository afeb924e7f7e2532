// twin: src/measure/wall_sums.rs
// What free grains do to walls at step n, in an order that no sorting changes: row p of every wall adds up the grains with
// the numbers p, p + rows, p + 2 rows, … Few grains are at a wall, so lists are looked through for their walls first.

/// Row p of all walls, or of driven ones alone.
fn add_up_row(p: u32, all: bool) {
    let near = walls_of_row(p);
    for (var w = 0u; w < params.walls; w++) {
        var load = WallLoad();
        if (((near >> min(w, 31u)) & 1u) != 0u && (all || wall[w].driven != 0u)) {
            load = load_of_row(p, w);
        }
        wall_load_sums[p * params.walls + w] = load;
    }
}

/// The walls on the lists of the row's grains, a bit each; those beyond the 31st share one.
fn walls_of_row(p: u32) -> u32 {
    var near = 0u;
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        let list = list_of(index_of_id[number]);
        // Walls come last, behind them what a slice leaves empty.
        for (var next = list.end; next > list.begin; next -= list.step) {
            let tagged = neighbour[next - list.step];
            if (tagged != NONE) {
                if ((tagged & INDEX) < params.bodies) {
                    break;
                }
                near |= 1u << min((tagged & INDEX) - params.bodies, 31u);
            }
        }
    }
    return near;
}

fn load_of_row(p: u32, w: u32) -> WallLoad {
    var load = WallLoad();
    for (var number = p; number < params.bodies; number += params.partial_sums_len) {
        let i = index_of_id[number];
        let list = list_of(i);
        for (var next = list.end; next > list.begin; next -= list.step) {
            let tagged = neighbour[next - list.step];
            if (tagged != NONE && (tagged & INDEX) <= params.bodies + w) {
                if ((tagged & INDEX) == params.bodies + w) {
                    load = with_contact(load, i, next - list.step, tagged);
                }
                break;
            }
        }
    }
    return load;
}

/// With the contact of body i in this entry of its list.
fn with_contact(before: WallLoad, i: u32, entry: u32, tagged: u32) -> WallLoad {
    var load = before;
    let here = body(i);
    let contact = contact_of(i, here, entry, tagged);
    if (!contact.is_active || here.velocity.inverse_mass == 0) {
        return load;
    }
    let arm = (here.position.x - wall[(tagged & INDEX) - params.bodies].point) + contact.arm;
    load.force -= contact.force;
    load.moment -= moment(arm, contact.force) + contact.couple;
    let n = contact.arm / sqrt(dot(contact.arm, contact.arm));
    load.normal_force -= dot(contact.force, n);
    // Rigid grains store nothing, and have no stiffness.
    if (contact.gap < 0 && contact.energy > 0) {
        let held = max(dot(contact.damping - contact.force, n), Real(0));
        load.stiffness += STEEPEST * held / -contact.gap;
    }
    return load;
}
