// twin: src/measure/wall_sums.rs
// What free grains do to walls at step n, in an order that no sorting changes: for every wall, row p adds up the grains
// with the numbers p, p + rows, p + 2 rows, …

/// Row k / walls of wall k % walls.
fn wall_loads_of_row(k: u32) -> WallLoad {
    let w = k % params.walls;
    var load = WallLoad();
    for (var number = k / params.walls; number < params.bodies; number += params.partial_sums_len) {
        let i = index_of_id[number];
        let list = list_of(i);
        // Walls come last, behind them what a slice leaves empty.
        for (var next = list.end; next > list.begin; next -= list.step) {
            let tagged = neighbour[next - list.step];
            if (tagged != NONE && (tagged & INDEX) <= params.bodies + w) {
                if ((tagged & INDEX) == params.bodies + w) {
                    let here = body(i);
                    let contact = contact_of(i, here, next - list.step, tagged);
                    if (here.velocity.inverse_mass > 0 && contact.is_active) {
                        load.force -= contact.force;
                        let arm = (here.position.x - wall[w].point) + contact.arm;
                        load.moment -= moment(arm, contact.force) + contact.couple;
                        let n = contact.arm / sqrt(dot(contact.arm, contact.arm));
                        load.normal_force -= dot(contact.force, n);
                        // Rigid grains store nothing, and have no stiffness.
                        if (contact.gap < 0 && contact.energy > 0) {
                            let held = max(dot(contact.damping - contact.force, n), Real(0));
                            load.stiffness += STEEPEST * held / -contact.gap;
                        }
                    }
                }
                break;
            }
        }
    }
    return load;
}
