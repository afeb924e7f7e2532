// twin: src/measure/contact_forces.rs
// Force and moment of all contacts of every grain at step n, for people and for checks; a step needs no array of them.
var<storage, read_write> force: array<Vec>; // N, N, without gravity

@compute @workgroup_size(WG)
fn contact_forces(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let sum = contacts_of(i, body(i));
    force[i] = sum.force;
    store_torque(i, sum.torque);
}
