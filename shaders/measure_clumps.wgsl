// twin: src/kernels/measure_clumps.rs
// What free clumps add to the sums over their members, in the same order: row p has clumps p, p + parts, p + 2 parts, …

@compute @workgroup_size(WG)
fn measure_clumps(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let p = linear(id, groups);
    if (p >= params.parts) {
        return;
    }
    var sum = part[p];
    for (var c = p; c < params.clumps; c += params.parts) {
        let here = clump(c);
        let inverse_mass = here.motion.inverse_mass;
        if (inverse_mass == 0) {
            continue;
        }
        let all = contacts_of_clump(c, here.attitude);
        let v = at_step(here.motion, all.force);
        let w = spin_of_clump_now(c, here, all.torque);
        let kinetic = 0.5 * dot(v, v) / inverse_mass + 0.5 * spin_dot(w, w / here.inverse_moments);
        let total = all.force + params.gravity / inverse_mass;
        sum.kinetic += kinetic;
        sum.potential -= dot(params.gravity, here.center.x + here.center.residue) / inverse_mass;
        sum.net_force += sqrt(dot(total, total));
        // Dashpots know the velocities of half a step ago, but it is those of now that they work against.
        let spin = global_spin(here.inverse_moments, here.attitude, w);
        sum.dissipation += 2 * params.damping * kinetic + dashpots_late(c, here.attitude, v, spin);
    }
    part[p] = sum;
}
