//! How steep the flanks of a heap are.

use super::skyline::{Skyline, free, largest, vertical};
use crate::scene::{Assembly, Grain};
use glam::DVec3;
use serde::Serialize;

/// The flanks of a heap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Slope {
    /// rad, from the horizontal.
    pub angle: f64,
    /// Its standard error.
    pub error: f64,
    /// Upright columns that it goes through.
    pub columns: usize,
}

/// The part of the height of a heap between whose ends its flanks are: neither the foot nor the top.
const FLANK: [f64; 2] = [0.2, 0.8];
/// Rings of columns that flanks consist of at least.
const FEWEST: usize = 3;

/// Slope of the heap that free grains have come to: a line through the highest grains of upright columns, two largest radii
/// wide, over their distance from the middle of the heap, where that is along the axes that do not repeat. Columns are those
/// between the last ring (as wide as a column) whose mean height is above 4/5 of the highest, and the first one below
/// 1/5 of it. None of what has no flanks.
pub fn slope(assembly: &Assembly, grains: &[Grain]) -> Option<Slope> {
    let (up, _) = vertical(assembly)?;
    let width = 2.0 * largest(grains);
    let sideways = |x: DVec3| {
        let open = |axis: usize| axis != up && axis < assembly.dimension && !assembly.domain.periodic[axis];
        DVec3::from_array([0, 1, 2].map(|axis| if open(axis) { x[axis] } else { 0.0 }))
    };
    let count = free(grains).count() as f64;
    let middle = free(grains).map(|grain| sideways(grain.position)).sum::<DVec3>() / count;
    let surface = Skyline::new(assembly, grains, width, 2.0 * width);
    let bottom = free(grains).filter_map(|grain| surface.column(grain.position)).map(|(_, height)| height);
    let bottom = bottom.fold(f64::INFINITY, f64::min);
    // Distance and height of every column, in the order of the distance, so that sums are the same whatever the map does.
    let mut tops: Vec<[f64; 2]> = surface
        .tops
        .iter()
        .map(|(column, top)| [(sideways(surface.middle(*column)) - middle).length(), top - bottom])
        .collect();
    tops.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let ring = |top: &[f64; 2]| (top[0] / width) as usize;
    let mut means = Vec::new();
    for of_ring in tops.chunk_by(|a, b| ring(a) == ring(b)) {
        means.push((ring(&of_ring[0]), of_ring.iter().map(|top| top[1]).sum::<f64>() / of_ring.len() as f64));
    }
    let highest = means.iter().map(|(_, mean)| *mean).fold(0.0, f64::max);
    let inner = means.iter().rev().find(|(_, mean)| *mean > FLANK[1] * highest)?.0;
    let outer = means.iter().find(|(ring, mean)| *ring > inner && *mean < FLANK[0] * highest)?.0;
    if outer < inner + 1 + FEWEST {
        return None;
    }
    let flanks: Vec<_> = tops.iter().filter(|top| (inner + 1..outer).contains(&ring(top))).collect();
    let n = flanks.len() as f64;
    let [x, y] = [0, 1].map(|k| flanks.iter().map(|top| top[k]).sum::<f64>() / n);
    let xx: f64 = flanks.iter().map(|top| (top[0] - x).powi(2)).sum();
    let xy: f64 = flanks.iter().map(|top| (top[0] - x) * (top[1] - y)).sum();
    let slope = -xy / xx;
    let left: f64 = flanks.iter().map(|top| (top[1] - y + slope * (top[0] - x)).powi(2)).sum();
    let error = (left / ((n - 2.0) * xx)).sqrt() / (1.0 + slope * slope);
    (slope > 0.0).then_some(Slope { angle: slope.atan(), error, columns: flanks.len() })
}
