// twin: src/kernels/sweep.rs
// Contact dynamics 3, coloured: all contacts of the next colour, each updated with a step of its own (of spheres that is
// Algorithm 1, which solves it exactly) for the velocities that the colours before have left.
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
    let l = turn_lever[k];
    let arm = l.own * met.n;
    let here = gripped(i, arm);
    var there = Grip();
    if (j < params.bodies) {
        there = gripped(j, -l.other * met.n);
    } else {
        there.motion.v = wall_velocity(j - params.bodies, place[i].x + arm);
    }
    var side = Side();
    side.n = met.n;
    side.closing = met.closing;
    side.normal = l.normal;
    side.tangential = l.tangential;
    side.friction = pair_of(i, j).friction;
    let surface = surface_velocity(here.spin, here.arm) - surface_velocity(there.spin, there.arm);
    side.velocity = (here.motion.v - there.motion.v) + surface;
    let old = unpacked(thrust[k]);
    let start = old + relaxation.beta * (old - unpacked(thrust_before[k]));
    let next = relaxed(side, start, Real(1));
    let far = natural_map(side, start, weight_of(turn[k].slot, side.tangential));
    miss[i] += dot(far, far);
    thrust_before[k] = packed(next);
    let change = next - start;
    push(i, here, change);
    if (j < params.bodies) {
        push(j, there, -change);
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
