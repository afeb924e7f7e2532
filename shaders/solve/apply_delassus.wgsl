// twin: src/solve/jacobi.rs
// A pass, 2 of 3: u = W r + q where the steps have ended, with a row of blocks of the Delassus operator W for each
// contact, and what it says of the steps.
var<storage, read> row_start: array<u32>; // contacts + 1
var<storage, read> column: array<u32>;    // blocks, ascending in every row
var<storage, read> w: array<Packed>;      // columns of blocks, one block after the other

fn pass_sums_of(k: u32) -> PassSums {
    if (k >= rule.contacts || paused()) {
        return PassSums();
    }
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
    let back = unpacked(y[k].r) - r;
    let on = r - unpacked(x[k].r);
    let side = contact_at(c, u);
    let error = natural_map(side, r, c.lambda);
    return PassSums(
        dot(error, error),
        scaled_product(side, back, on),
        dot(back, unpacked(y[k].u) - u),
        scaled_product(side, back, back),
    );
}

@compute @workgroup_size(WG)
fn apply_delassus(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let k = linear(id, groups);
    let sum = sum_of_lanes(k % WG, WG, pass_sums_of(k));
    if (k % WG == 0u && k < rule.contacts) {
        pass_sums[k / WG] = sum;
    }
}
