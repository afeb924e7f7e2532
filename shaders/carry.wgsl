// twin: src/kernels/carry.rs
// A step of clumps 3: members follow from where their clumps are. Their velocity is that of the middle of the step, when the arm
// was the mean of what it was and is.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn carry(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (halt != 0u) {
        if (i == 0u) {
            atomicStore(&halt_next, 1u);
        }
        return;
    }
    let label = number[i];
    let c = owner[label];
    let before = attitude[c] + attitude_residue_of(c);
    let motion = clump_motion_next[c];
    // The turn about its own axis leaves the spin as it is.
    let spin = global_spin(inverse_moments[c], before, clump_spin_next[c]);
    let arm = arm_of(before, label);
    let gain = arm_gain(attitude_gain(0.25 * params.dt * spin), arm);
    motion_next[i] = Motion(motion.v + surface_velocity(spin, arm + 0.5 * gain), motion.inverse_mass);
    keep_spin(i, spin);
    let center = Point(center_next[c], center_residue_next_of(c));
    let point = wrapped(carried(center, attitude_next[c], attitude_residue_next_of(c), unpacked(offset[label])));
    let way = params.dt * motion.v + gain;
    if (arrive(i, place[i], residue_of(i), point, sqrt(dot(way, way)), false)) {
        atomicStore(&halt_next, 1u);
    }
}
