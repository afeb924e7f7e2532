// twin: src/laws/precision.rs
// Precision slot: numbers are f32. A position is kept as a multiple of params.quantum (a few units in the last place of
// the scene's extent, a power of two) and a residue within half of that, so that slow motion far from the origin is not
// lost to rounding and small overlaps keep their digits. Owns the residues. A compensated sum would not do: drivers may
// simplify (a + b) - a, but sums of multiples of a power of two are exact in whatever order.
alias Real = f32;
alias Real2 = vec2<f32>;
alias Real3 = vec3<f32>;

var<storage, read_write> residue: array<Vec>; // N, m: what a position has beyond place.x

fn residue_of(i: u32) -> Vec {
    return residue[i];
}

/// The multiple of the quantum nearest to d, m.
fn quantised(d: Vec) -> Vec {
    return params.quantum * floor(d * params.inverse_quantum + Vec(0.5));
}

/// x + step, brought into the domain; what is less than a quantum goes into the residue.
fn displace(i: u32, x: Vec, step: Vec) -> Vec {
    let y = residue[i] + step;
    let whole = quantised(y);
    let moved = x + whole;
    let k = image(moved);
    residue[i] = (y - whole) - params.period_rest * k;
    return moved - params.period * k;
}
