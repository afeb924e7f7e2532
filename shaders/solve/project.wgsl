// twin: src/solve/jacobi.rs
// A pass, 1 of 3: momentum leads on from the last iterate, and there every contact takes its step: the push, then the friction
// within the disc that this push allows.
var<storage, read_write> best: array<Packed>; // r of the best pass

fn disc(c: Contact, r: Vec, u: Vec, step: Real) -> Vec {
    let push = max(r.x - step / c.normal * u.x, Real(0));
    var friction = across(r) - step / c.tangent * across(u);
    let length = length_of(friction);
    let most = c.mu * push;
    if (length > most) {
        friction *= most / length;
    }
    return push * first_axis() + friction;
}

@compute @workgroup_size(WG)
fn project(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(id, groups);
    if (k >= rule.contacts) {
        return;
    }
    // Also where the passes end: what comes after the last of them is this.
    if (relaxation.improved != 0u) {
        best[k] = next[k];
    }
    if (paused()) {
        return;
    }
    let old = x[k];
    var r = unpacked(old.r);
    var u = unpacked(old.u);
    if (relaxation.accepted != 0u) {
        let last = Iterate(next[k], u_next[k]);
        x[k] = last;
        // u is affine in r, so that of y costs no product.
        r = unpacked(last.r) + relaxation.beta * (unpacked(last.r) - r);
        u = unpacked(last.u) + relaxation.beta * (unpacked(last.u) - u);
    }
    y[k] = Iterate(packed(r), packed(u));
    next[k] = packed(disc(contact[k], r, u, 1 / relaxation.largest));
}
