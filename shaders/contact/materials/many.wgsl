// twin: src/contact/materials.rs
// Materials slot: several materials. Owns the material of every grain and wall and the table of pairs.
var<storage, read> material: array<u32>; // N + walls, by number in the scene
var<storage, read> pair: array<Pair>;    // materials²

/// The material of grain i, or of a wall.
fn material_of(i: u32) -> u32 {
    if (i < params.bodies) {
        return material[id[i]];
    }
    return material[i];
}

/// Where the pair of materials of i and j is in the tables of pairs.
fn pair_index(i: u32, j: u32) -> u32 {
    return material_of(i) * params.materials + material_of(j);
}

fn pair_of(i: u32, j: u32) -> Pair {
    return pair[pair_index(i, j)];
}
