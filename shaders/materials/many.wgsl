// twin: src/laws/materials.rs
// Materials slot: several materials. Owns the material of every grain and wall and the table of pairs.
var<storage, read> material: array<u32>; // N + walls
var<storage, read> pair: array<Pair>;    // materials²

fn pair_of(i: u32, j: u32) -> Pair {
    return pair[material[i] * params.materials + material[j]];
}
