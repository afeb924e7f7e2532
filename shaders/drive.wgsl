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
    var sum = Gathered();
    for (var label = first_member[c]; label < first_member[c + 1u]; label++) {
        let i = whereabouts[label];
        let force = pull[i];
        sum.force += force;
        sum.torque += twist[i] + moment(arm_of(here.attitude, label), force);
    }
    let v = advanced(here.motion, sum.force);
    var w = here.spin;
    if (!is_round(here.inverse_moments)) {
        let gain = gained(here, own_torque(here, sum.torque), spin_gain[c]);
        w += gain.spin;
        spin_gain[c] = gain.spin;
        if (gain.rounds > atomicLoad(&rounds.most)) {
            atomicMax(&rounds.most, gain.rounds);
        }
        if (!gain.settled) {
            atomicAdd(&rounds.capped, 1u);
        }
    } else if (here.motion.inverse_mass != 0) {
        w = spun(w, here.inverse_moments * sum.torque);
    }
    let point = wrapped(moved(here.center.x, here.center.residue, params.dt * v));
    center_next[c] = point.x;
    keep_center_residue(c, point.residue);
    clump_motion_next[c] = Motion(v, here.motion.inverse_mass);
    clump_spin_next[c] = w;
    let next = turned_on(attitude[c], attitude_residue_of(c), attitude_step(c, here, w));
    attitude_next[c] = next.q;
    keep_attitude_residue(c, next.residue);
}
