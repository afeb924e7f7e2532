// twin: src/neighbours/levels.rs
// Levels slot: grains are of many sizes. A pair of two levels is found by its finer grain, around which there are few
// cells of coarser levels. In each list, neighbours on other levels have the last entries until the list is ordered.
var<storage, read_write> across: array<atomic<u32>>;        // N: entries for neighbours on other levels
var<storage, read_write> across_filled: array<atomic<u32>>; // N: how many of them have been filled

/// The level of grains of this radius.
fn level_of(radius: Real) -> u32 {
    var k = 0u;
    while (k + 1u < params.levels && radius > level[k].radius) {
        k++;
    }
    return k;
}

/// Entries of grain i for neighbours on other levels.
fn entries_across(i: u32) -> u32 {
    return atomicLoad(&across[i]);
}

/// How many of them have been filled.
fn filled_across(i: u32) -> u32 {
    return atomicLoad(&across_filled[i]);
}
