//! Twin of `shaders/neighbours/scan_reduce.wgsl`, `scan_top.wgsl` and `scan_down.wgsl`: exclusive prefix sum in place. Sums that
//! would exceed the largest number are that: so what is too much is seen.

use crate::state::TILE;

/// The sum of each tile.
pub fn scan_reduce(values: &[u32], tile_sum: &mut [u32]) {
    for (sum, values) in tile_sum.iter_mut().zip(values.chunks(TILE)) {
        *sum = values.iter().fold(0, |sum: u32, value| sum.saturating_add(*value));
    }
}

/// The sums of the tiles, in place.
pub fn scan_top(values: &[u32], tile_sum: &mut [u32]) {
    exclusive(&mut tile_sum[..values.len().div_ceil(TILE)], 0);
}

/// Each tile in place, from the sum of all tiles before it.
pub fn scan_down(values: &mut [u32], tile_sum: &[u32]) {
    for (values, before) in values.chunks_mut(TILE).zip(tile_sum) {
        exclusive(values, *before);
    }
}

fn exclusive(values: &mut [u32], mut before: u32) {
    for value in values {
        before = before.saturating_add(std::mem::replace(value, before));
    }
}
