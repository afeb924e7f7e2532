// twin: src/kernels/measure.rs
// Sums over free grains at step n, in a fixed order: row p adds up grains p, p + parts, p + 2 parts, …
var<storage, read_write> part: array<Part>;      // parts

struct Part {
    kinetic: Real,       // J, velocities brought to step n
    potential: Real,     // J
    elastic: Real,       // J, normal and tangential springs
    net_force: Real,     // N, sum of |total force| over free grains
    contact_force: Real, // N, sum of |spring force| over contacts
    dissipation: Real,   // W, of dashpots, sliding, contacts that open and global damping
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
        let here = body(i);
        let inverse_mass = here.motion.inverse_mass;
        if (inverse_mass == 0) {
            continue;
        }
        var force = Vec();
        var torque = Spin();
        var drag = Vec(); // N, of all dashpots
        let end = slot_start[i + 1u];
        for (var slot = slot_start[i]; slot < end; slot++) {
            let entry = neighbour[slot];
            if (entry == NONE) {
                break;
            }
            let contact = contact_of(i, here, slot, entry);
            let j = entry & INDEX;
            var smaller = here.place.radius;
            var single = true;
            if (j < params.bodies) {
                smaller = min(smaller, place[j].radius);
                single = motion[j].inverse_mass == 0;
            }
            let share = select(Real(0.5), Real(1), single);
            let pair = pair_of(i, j);
            if (!contact.closed) {
                // Opened since the last step, if it has a spring, whose energy the next step forgets.
                sum.dissipation += share * spring_energy(spring_of(slot, entry), pair) / params.dt;
                continue;
            }
            force += contact.force;
            torque += moment(contact.arm, contact.force);
            drag += contact.damping;
            sum.elastic += share * (normal_energy(pair, contact.gap) + spring_energy(contact.spring, pair));
            let held = contact.force - contact.damping;
            sum.contact_force += share * sqrt(dot(held, held));
            sum.dissipation += share * contact.dissipation;
            sum.overlap = max(sum.overlap, -contact.gap / smaller);
            sum.sides += 1u;
            sum.single_sides += select(0u, 1u, single);
        }
        let v = velocity_now(here, force);
        let kinetic = 0.5 * dot(v, v) / inverse_mass + spin_energy(here, spin_now(here, torque));
        let total = force + params.gravity / inverse_mass;
        sum.kinetic += kinetic;
        sum.potential -= dot(params.gravity, here.place.x + here.residue.x) / inverse_mass;
        sum.net_force += sqrt(dot(total, total));
        // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
        sum.dissipation += 2 * params.damping * kinetic - dot(drag, v - here.motion.v);
    }
    part[p] = sum;
}
