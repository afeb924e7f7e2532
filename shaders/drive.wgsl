// twin: src/kernels/drive.rs
// A step of clumps 2: what acts on the members of a clump, gathered in the order of their numbers, moves and turns it, from
// n - 1/2 to n + 1/2 and from n to n + 1.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn drive(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(id, groups);
    if (c >= params.clumps || halt != 0u) {
        return;
    }
    let here = clump(c);
    let sum = gathered_by_clump(c, here.attitude);
    let v = advanced(here.motion, sum.force);
    var w = here.spin;
    if (!spins_in_scene(here.inverse_moments)) {
        let gain = gained(here, own_torque(here, sum.torque), spin_gain[c]);
        w += gain.spin;
        spin_gain[c] = gain.spin;
        count_rounds(gain.rounds, gain.settled);
    } else if (here.motion.inverse_mass != 0) {
        w = spun(w, here.inverse_moments * sum.torque);
    }
    move_clump(c, here, v, w);
}
