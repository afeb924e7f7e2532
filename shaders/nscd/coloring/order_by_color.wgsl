// twin: src/nscd/coloring/order_by_color.rs
// Colors 3: contacts with the impulses they have now, in the order of the colours. Momentum begins anew.
var<storage, read_write> color_count: array<u32>;         // colours: contacts there are of each

@compute @workgroup_size(WG)
fn order_by_color(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = linear(gid, groups);
    if (i >= params.bodies) {
        return;
    }
    let list = list_of(i);
    let end = select(list.end, 0u, is_large(i));
    for (var entry = list.begin; entry < end; entry += lists_abreast()) {
        let tagged = neighbour[entry];
        if (tagged == NONE) {
            break;
        }
        let j = tagged & INDEX;
        let own = contact_color[entry];
        if (own.color == 0u || j < i) {
            continue;
        }
        var at = own.rank;
        for (var color = 1u; color < own.color; color++) {
            at += color_count[color - 1u];
        }
        var back = NONE;
        if (j < params.bodies) {
            back = entry_of(j, i);
        }
        colored_contact[at] = ColoredContact(select(NONE, i, (tagged & ACTIVE) != 0u), j, entry, back);
        colored_geometry[at] = contact_geometry[entry];
        colored_free_velocity[at] = free_contact_velocity[entry];
        colored_inverse_effective_mass[at] = inverse_effective_mass[entry];
        let impulse = packed(impulse_of(entry));
        colored_impulse[at] = impulse;
        colored_impulse_before[at] = impulse;
    }
    let start = pass_velocity[i];
    let spin = pass_spin_of(i);
    pass_velocity_before[i] = start;
    extrapolated_velocity[i] = start;
    store_pass_spin_before(i, spin);
    store_extrapolated_spin(i, spin);
    if (i == 0u) {
        solver_state.theta = 1;
        solver_state.beta = 0;
    }
}
