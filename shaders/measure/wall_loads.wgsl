// twin: src/measure/wall_loads.rs
// What free grains do to walls at step n, in an order that no sorting changes: for every wall, row p adds up the grains
// with the numbers p, p + rows, p + 2 rows, …
@compute @workgroup_size(WG)
fn wall_loads(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(gid, groups);
    if (k >= params.partial_sums_len * params.walls) {
        return;
    }
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
                    }
                }
                break;
            }
        }
    }
    wall_load_sums[k] = load;
}
