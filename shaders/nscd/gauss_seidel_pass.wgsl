// twin: src/nscd/gauss_seidel_pass.rs
// Contact dynamics 3, coloured: all contacts of the next colour, each updated with a step of its own (of spheres that
// is Algorithm 1, which solves it exactly) for the velocities that the colours before have left.
var<storage, read_write> color_count: array<u32>;    // colours: contacts there are of each
var<storage, read_write> color_cursor: ColorCursor;
var<storage, read_write> color_cursor_next: ColorCursor;
var<storage, read_write> pass_residual: array<Real>; // N, (m/s)²: squares of the natural map that the sweep has met

fn update(k: u32) {
    let i = colored_contact[k].first;
    let j = colored_contact[k].second;
    if (i == NONE) {
        return;
    }
    let geometry = colored_geometry[k];
    let inverse_mass = colored_inverse_effective_mass[k];
    let arm = inverse_mass.arm * geometry.n;
    let here = contact_body(i, arm);
    var there = ContactBody();
    if (j < params.bodies) {
        there = contact_body(j, -inverse_mass.arm_to * geometry.n);
    }
    let surface = surface_velocity(here.spin, here.arm) - surface_velocity(there.spin, there.arm);
    let pushed = (here.velocity.v - there.velocity.v) + surface;
    let old = unpacked(colored_impulse[k]);
    let start = old + solver_state.beta * (old - unpacked(colored_impulse_before[k]));
    let rigid = contact_at(i, j, geometry, inverse_mass, pushed + unpacked(colored_free_velocity[k]));
    let compliance = compliance_of(pair_of(i, j), inverse_mass);
    let side = compliant(rigid, compliance, start);
    let next = disc_update(side, start, Real(1));
    let error = natural_map(side, start, natural_map_scale(colored_contact[k].entry, side, compliance));
    pass_residual[i] += dot(error, error);
    colored_impulse_before[k] = packed(next);
    let change = next - start;
    apply_impulse(i, here, change);
    if (j < params.bodies) {
        apply_impulse(j, there, -change);
    }
}

@compute @workgroup_size(WG)
fn gauss_seidel_pass(@builtin(global_invocation_id) gid: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let first = linear(gid, groups);
    let begin = color_cursor.contacts;
    let end = begin + color_count[color_cursor.colors];
    if (first == 0u) {
        color_cursor_next = ColorCursor(color_cursor.colors + 1u, end);
    }
    // A loop, because there are fewer contacts than invocations, and software drivers skip loops but not branches.
    for (var k = begin + first; k < end; k += groups.x * groups.y * WG) {
        update(k);
    }
}
