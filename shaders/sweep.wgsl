// twin: src/kernels/sweep.rs
// Contact dynamics 3, coloured: all contacts of the next colour, each solved exactly (Algorithm 1) for the velocities that the
// colours before have left.
var<storage, read_write> painted: array<u32>;    // colours: contacts there are of each
var<storage, read_write> brush: Brush;
var<storage, read_write> brush_next: Brush;
var<storage, read_write> miss: array<Real>;      // N, (m/s)²: natural map that the sweep has met

fn update(k: u32) {
    let i = turn[k].first;
    let j = turn[k].second;
    if (i == NONE) {
        return;
    }
    let met = turn_meeting[k];
    let grip = turn_lever[k];
    let here = ahead[i];
    let spin = ahead_spin_of(i);
    let arm = grip.own * met.n;
    let arm_to = -grip.other * met.n;
    var there = Motion();
    var spin_to = Spin();
    if (j < params.bodies) {
        there = ahead[j];
        spin_to = ahead_spin_of(j);
    } else {
        there.v = wall_velocity(j - params.bodies, place[i].x + arm);
    }
    var side = Side();
    side.n = met.n;
    side.closing = met.closing;
    side.normal = grip.normal;
    side.tangential = grip.tangential;
    side.friction = pair_of(i, j).friction;
    side.velocity = (here.v - there.v) + (surface_velocity(spin, arm) - surface_velocity(spin_to, arm_to));
    let old = unpacked(thrust[k]);
    let start = old + relaxation.beta * (old - unpacked(thrust_before[k]));
    let next = relaxed(side, start, Real(1));
    let far = natural_map(side, start, side.tangential);
    miss[i] += dot(far, far);
    thrust_before[k] = packed(next);
    let change = next - start;
    let inertia = inverse_inertia(place[i], here.inverse_mass);
    ahead[i] = Motion(here.v + here.inverse_mass * change, here.inverse_mass);
    keep_ahead_spin(i, spin + inertia * moment(arm, change));
    if (j < params.bodies) {
        let inertia_to = inverse_inertia(place[j], there.inverse_mass);
        ahead[j] = Motion(there.v - there.inverse_mass * change, there.inverse_mass);
        keep_ahead_spin(j, spin_to - inertia_to * moment(arm_to, change));
    }
}

@compute @workgroup_size(WG)
fn sweep(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let first = linear(id, groups);
    let begin = brush.contacts;
    let end = begin + painted[brush.colours];
    if (first == 0u) {
        brush_next = Brush(brush.colours + 1u, end);
    }
    // A loop, because there are fewer contacts than invocations, and software drivers skip loops but not branches.
    for (var k = begin + first; k < end; k += groups.x * groups.y * WG) {
        update(k);
    }
}
