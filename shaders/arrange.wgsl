// twin: src/kernels/arrange.rs
// Colours 3: contacts with the impulses they have now, in the order of the colours. Momentum begins anew.
var<storage, read_write> painted: array<u32>;         // colours: contacts there are of each

@compute @workgroup_size(WG)
fn arrange(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(id, groups);
    if (i >= params.bodies) {
        return;
    }
    let end = slot_start[i + 1u];
    for (var slot = slot_start[i]; slot < end; slot++) {
        let entry = neighbour[slot];
        if (entry == NONE) {
            break;
        }
        let j = entry & INDEX;
        let own = hue[slot];
        if (own.colour == 0u || j < i) {
            continue;
        }
        var at = own.rank;
        for (var colour = 1u; colour < own.colour; colour++) {
            at += painted[colour - 1u];
        }
        var back = NONE;
        if (j < params.bodies) {
            back = slot_start[j];
            while ((neighbour[back] & INDEX) != i) {
                back++;
            }
        }
        turn[at] = Turn(select(NONE, i, (entry & SPRUNG) != 0u), j, slot, back);
        turn_meeting[at] = meeting[slot];
        turn_lever[at] = lever[slot];
        let impulse = packed(kept_spring(slot));
        thrust[at] = impulse;
        thrust_before[at] = impulse;
    }
    let start = trial[i];
    let spin = trial_spin_of(i);
    trial_before[i] = start;
    ahead[i] = start;
    keep_trial_spin_before(i, spin);
    keep_ahead_spin(i, spin);
    if (i == 0u) {
        relaxation.theta = 1;
        relaxation.beta = 0;
    }
}
