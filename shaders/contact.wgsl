// twin: src/kernels/contact.rs
// Force and moment of all contacts of one grain, gathered in ascending order of the other's id.
var<storage, read> place: array<Place>;          // N, at step n
var<storage, read> motion: array<Motion>;        // N, at n - 1/2
var<storage, read> slot_start: array<u32>;       // N + 1
var<storage, read> neighbour: array<u32>;        // slots
var<storage, read_write> force: array<Vec>;      // N, N, at step n, without gravity
var<storage, read_write> counters: Counters;

@compute @workgroup_size(WG)
fn contact(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies || slot_start[i + 1u] > arrayLength(&neighbour)) {
        return;
    }
    let here = place[i];
    let moving = motion[i];
    let spinning = spin_of(i);
    let residue_here = residue_of(i);
    let end = slot_start[i + 1u];
    var force_sum = Vec();
    var torque_sum = Spin();
    for (var slot = slot_start[i]; slot < end; slot++) {
        let j = neighbour[slot];
        if (j == NONE) {
            break;
        }
        var touch: Touch;
        var there: Place;
        if (j < params.bodies) {
            there = place[j];
            touch = touch_grain(i, j, here, there, residue_of(j) - residue_here);
        } else {
            touch = touch_wall(j - params.bodies, here.x, residue_here, here.radius);
            if (touch.gap < -here.radius) {
                atomicMax(&counters.bad_body, params.bodies - i);
            }
        }
        if (!(touch.gap < 0)) {
            forget_spring(slot);
            continue;
        }
        let n = touch.n;
        let arm = (here.radius + 0.5 * touch.gap) * n; // erratum E7: one shared point, mid-overlap
        var v_rel: Vec;
        var n_before: Vec;
        var inverse_mass = moving.inverse_mass;
        if (j < params.bodies) {
            let other = motion[j];
            let v = moving.v - other.v;
            let arm_there = -(there.radius + 0.5 * touch.gap) * n;
            v_rel = v + (surface_velocity(spinning, arm) - surface_velocity(spin_of(j), arm_there));
            n_before = unit_or((here.radius + there.radius + touch.gap) * n + params.dt * v, n);
            inverse_mass += other.inverse_mass;
        } else {
            let w = j - params.bodies;
            v_rel = (moving.v - wall_velocity(w, here.x + arm)) + surface_velocity(spinning, arm);
            n_before = wall_normal_before(w, here.x - params.dt * moving.v);
        }
        let pair = pair_of(i, j);
        let pressing = normal_force(pair, touch.gap) + dashpot_force(pair, dot(v_rel, n), inverse_mass);
        let f = -pressing * n + tangential_force(slot, pair, n, n_before, v_rel, pressing);
        force_sum += f;
        torque_sum += moment(arm, f);
    }
    force[i] = force_sum;
    store_torque(i, torque_sum);
}
