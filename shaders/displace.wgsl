// twin: src/kernels/displace.rs
// Contact dynamics 8: the end of a step, positions n to n + 1 with the velocities n + 1.
var<storage, read_write> halt: atomic<u32>;

@compute @workgroup_size(WG)
fn displace(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.done, 1u);
    }
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let impulse = kept_spring(slot);
        flag(slot, entry, any(impulse != Vec()));
    }
    let here = place[i];
    let residue = residue_of(i);
    let v = trial[i].v;
    let point = wrapped(moved(here.x, residue.x, params.dt * v));
    motion_next[i] = Motion(v, motion[i].inverse_mass);
    keep_spin(i, trial_spin_of(i));
    if (arrive(i, here, residue, point, params.dt * sqrt(dot(v, v)), false)) {
        atomicStore(&halt, 1u); // the host will take the step back, and walls must not have moved
    }
}
