// twin: src/kernels/measure.rs
// Sums over free grains at step n, in a fixed order: row p adds up grains p, p + parts, p + 2 parts, …
var<storage, read> place: array<Place>;          // N
var<storage, read> motion: array<Motion>;        // N
var<storage, read> force: array<Vec>;            // N
var<storage, read> slot_start: array<u32>;       // N + 1
var<storage, read> neighbour: array<u32>;        // slots
var<storage, read_write> part: array<Part>;      // parts

struct Part {
    kinetic: Real,       // J, velocities brought to step n
    potential: Real,     // J
    elastic: Real,       // J, normal and tangential springs
    net_force: Real,     // N, sum of |total force| over free grains
    contact_force: Real, // N, sum of |spring force| over contacts
    overlap: Real,       // largest overlap over the smaller radius
    sides: u32,          // contacts of free grains; one between two free grains is seen twice
    single_sides: u32,   // those of them with a wall or a fixed grain
}

@compute @workgroup_size(WG)
fn measure(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(id, groups);
    if (p >= params.parts) {
        return;
    }
    var sum = Part();
    for (var i = p; i < params.bodies; i += params.parts) {
        let here = place[i];
        let inverse_mass = motion[i].inverse_mass;
        if (inverse_mass == 0) {
            continue;
        }
        let total = force[i] + params.gravity / inverse_mass;
        let v = (motion[i].v + 0.5 * params.dt * inverse_mass * total) / (1 + 0.5 * params.dt * params.damping);
        sum.kinetic += 0.5 * dot(v, v) / inverse_mass + spin_energy(i, here, inverse_mass);
        sum.potential -= dot(params.gravity, here.x) / inverse_mass;
        sum.net_force += sqrt(dot(total, total));
        let residue_here = residue_of(i);
        let end = slot_start[i + 1u];
        for (var slot = slot_start[i]; slot < end; slot++) {
            let j = neighbour[slot];
            if (j == NONE) {
                break;
            }
            var touch: Touch;
            var smaller = here.radius;
            var single = true;
            if (j < params.bodies) {
                touch = touch_grain(i, j, here, place[j], residue_of(j) - residue_here);
                smaller = min(smaller, place[j].radius);
                single = motion[j].inverse_mass == 0;
            } else {
                touch = touch_wall(j - params.bodies, here.x, residue_here, here.radius);
            }
            if (!(touch.gap < 0)) {
                continue;
            }
            let share = select(Real(0.5), Real(1), single);
            let pair = pair_of(i, j);
            let normal = normal_force(pair, touch.gap);
            let tangential = tangential_length(slot);
            sum.elastic += share * (normal_energy(pair, touch.gap) + tangential_energy(slot, pair));
            sum.contact_force += share * sqrt(normal * normal + tangential * tangential);
            sum.overlap = max(sum.overlap, -touch.gap / smaller);
            sum.sides += 1u;
            sum.single_sides += select(0u, 1u, single);
        }
    }
    part[p] = sum;
}
