// twin: src/contact/materials.rs
// Materials slot: several materials. Owns the material of every grain and wall and the table of pairs.
var<storage, read> material: array<u32>; // N + walls, by number in the scene
var<storage, read> pair: array<Pair>;    // materials²

fn material_of(i: u32) -> u32 {
    if (i < params.bodies) {
        return material[id[i]];
    }
    return material[i];
}

fn pair_of(i: u32, j: u32) -> Pair {
    return pair[material_of(i) * params.materials + material_of(j)];
}
