// twin: src/solve/jacobi.rs
// A pass, 2 of 3: u = W r + q where the steps have ended, a row of blocks for each contact, and what it says of the steps.
var<storage, read> row_start: array<u32>; // contacts + 1
var<storage, read> column: array<u32>;    // blocks, ascending in every row
var<storage, read> w: array<Packed>;      // columns of blocks, one block after the other

/// Largest eigenvalue (r - P(r - (u + mu |u_T| n) / lambda)), P the projection on the friction cone: 0 for Coulomb's law.
fn natural_map(c: Contact, r: Vec, u: Vec) -> Vec {
    let corrected = u + c.mu * length_of(across(u)) * first_axis();
    let end = c.lambda * r - corrected;
    let side = across(end);
    let length = length_of(side);
    if (c.mu * length <= -end.x) {
        return c.lambda * r;
    }
    if (length <= c.mu * end.x) {
        return corrected; // no difference, which would lose digits
    }
    let push = (end.x + c.mu * length) / (1 + c.mu * c.mu);
    return c.lambda * r - (push * first_axis() + c.mu * push / length * side);
}

fn multiplied(k: u32) -> Sums {
    let c = contact[k];
    var u = unpacked(c.q);
    let end = row_start[k + 1u];
    for (var block = row_start[k]; block < end; block++) {
        let r = unpacked(next[column[block]]);
        for (var axis = 0u; axis < DIMENSIONS; axis++) {
            u += r[axis] * unpacked(w[block * DIMENSIONS + axis]);
        }
    }
    u_next[k] = packed(u);
    let r = unpacked(next[k]);
    let step = r - unpacked(y[k].r);
    let far = natural_map(c, r, u);
    return Sums(
        dot(far, far),
        scaled(c, step, step),
        dot(step, u - unpacked(y[k].u)),
        scaled(c, r, r),
        -scaled(c, step, r - unpacked(x[k].r)),
    );
}

@compute @workgroup_size(WG)
fn multiply(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let k = linear(id, groups);
    of_lane[lane] = Sums();
    if (k < rule.contacts && !paused()) {
        of_lane[lane] = multiplied(k);
    }
    let sum = gathered(lane, WG);
    if (lane == 0u && k < rule.contacts) {
        sums[k / WG] = sum;
    }
}
