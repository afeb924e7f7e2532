// twin: src/laws/precision.rs
// Precision slot: with numbers in f32 a position is kept as a multiple of params.quantum (a few units in the last place of
// the scene's extent, a power of two) and a residue within half of that, so that slow motion far from the origin is not
// lost to rounding and small overlaps keep their digits. Owns the residues. A compensated sum would not do: drivers may
// simplify (a + b) - a, but sums of multiples of a power of two are exact in whatever order.
var<storage, read> residue: array<Residue>;            // N
var<storage, read_write> residue_next: array<Residue>; // N

fn residue_of(i: u32) -> Residue {
    return residue[i];
}

fn keep_residue(i: u32, value: Residue) {
    residue_next[i] = value;
}

/// x + residue + step, split anew.
fn moved(x: Vec, residue: Vec, step: Vec) -> Point {
    let y = residue + step;
    let whole = params.quantum * floor(y * params.inverse_quantum + Vec(0.5));
    return Point(x + whole, y - whole);
}

/// |d + rest| - (a + b + radii_rest), with the digits that this subtraction would lose: it is (d² - s²) / (d + s), and the leading 15
/// bits of the lengths are squared and cancelled as integers. d, a and b are exact, rest and radii_rest are small, distance
/// is |d + rest|.
fn gap_between(d: Vec, rest: Vec, distance: Real, a: Real, b: Real, radii_rest: Real) -> Real {
    let d_whole = round(d * params.inverse_split); // not floor(x + 0.5): both grains must get the same
    let d_rest = (d - params.split * d_whole) + rest;
    let a_whole = round(a * params.inverse_split);
    let b_whole = round(b * params.inverse_split);
    let s_rest = (a - params.split * a_whole) + (b - params.split * b_whole) + radii_rest;
    let s_whole = a_whole + b_whole;
    let squares = Real(dot(Whole(d_whole), Whole(d_whole)) - i32(s_whole) * i32(s_whole));
    let mixed = dot(d_whole, d_rest) - s_whole * s_rest;
    let rests = dot(d_rest, d_rest) - s_rest * s_rest;
    return (params.split * (params.split * squares + 2 * mixed) + rests) / (distance + (a + b));
}
