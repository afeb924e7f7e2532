// twin: src/kernels/load.rs
// A step of clumps 1: contact forces at step n on every member, gathered in ascending order of the other's id.
var<storage, read> halt: u32;
var<storage, read_write> halt_next: atomic<u32>;

@compute @workgroup_size(WG)
fn load(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies || halt != 0u) {
        return;
    }
    if (i == 0u) {
        atomicAdd(&counters.done, 1u);
    }
    let here = body(i);
    let end = slot_start[i + 1u];
    var sum = Gathered();
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let contact = contact_of(i, here, slot, entry);
        if (contact.closed) {
            keep_spring(slot, contact.spring);
            sum.force += contact.force;
            sum.torque += moment(contact.arm, contact.force);
            if ((entry & INDEX) >= params.bodies && contact.gap < -here.place.radius) {
                atomicMax(&counters.bad_body, params.bodies - number[i]);
                atomicStore(&halt_next, 1u);
            }
        }
        flag(slot, entry, contact.closed);
    }
    pull[i] = sum.force;
    twist[i] = sum.torque;
}
