// twin: src/dem/integrate_clumps.rs
// A step of clumps 2: what acts on the members of a clump, gathered in the order of their numbers, moves and turns it,
// from n - 1/2 to n + 1/2 and from n to n + 1.
var<storage, read> halt: u32;

@compute @workgroup_size(WG)
fn integrate_clumps(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let c = linear(gid, groups);
    if (c >= params.clumps || halt >= HALTED) {
        return;
    }
    let here = clump(c);
    let sum = clump_load(c, here.orientation);
    var change = Spin();
    if (!spins_in_scene(here.inverse_moments)) {
        let gain = predictor_corrector(here, own_torque(here, sum.torque), spin_increment[c]);
        change = gain.spin;
        spin_increment[c] = gain.spin;
        count_iterations(gain.rounds, gain.settled);
    } else if (here.velocity.inverse_mass != 0) {
        change = spin_change(here.spin, here.inverse_moments * sum.torque);
    }
    move_clump(c, here, velocity_change(here.velocity, sum.force), change);
}
